"""Free runs of a twin, driven by a recorded command: the three passes in order, many runs at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pendulum_twin import compose, kernel
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place
from pendulum_twin.motion import ALL_LAWS, NO_LAWS, PLAIN_LAWS
from pendulum_twin.signals import Floats, Signals
from pendulum_twin.words import SIZE, SLOTS, active

Ints = NDArray[np.int64]

_MECHANICAL = np.array([e.place in (Place.CART, Place.POLE) for e in CATALOGUE])
_COSTLY = np.array([compose.costly(e) for e in CATALOGUE])
_STICKING = np.array([e.form in (Form.DRY, Form.HOLD) for e in CATALOGUE])
_MEASURING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form is Form.MEASURE]
_FILTERING = np.concatenate([np.arange(SIZE)[SLOTS[e.name]] for e in CATALOGUE if e.form is Form.FILTER])


def free_runs(signals: Signals, words: Floats, set_of: Ints, begin: Ints, starts: Floats, samples: int) -> Floats:
    """Return what the sensors would have shown in runs of a twin driven by the recorded command.

    words: (sets, SIZE), the twins. set_of: (runs,) which twin each run has. begin: (runs,) sample at which it starts;
    the run must stay inside the recording. starts: (runs, 4) measured x, th, v, w there. Returns (runs, samples, 4),
    the first sample the start itself.
    """
    sub = kernel.substeps(signals.period_s)
    drives, drive_of = drive_pass(signals, words)
    lane_words = words[set_of]
    true = np.empty((len(begin), samples, 4))
    run_mechanics(
        drives,
        drive_of[set_of],
        np.asarray(begin, dtype=np.int64) * sub,
        unmeasured(starts, lane_words),
        lane_words,
        signals.period_s / sub,
        sub,
        true,
    )
    return measured(true, lane_words)


def drive_pass(signals: Signals, words: Floats) -> tuple[Floats, Ints]:
    """Return what command and drive make of the whole recording, (rows, samples * substeps), and each twin's row.

    Twins whose command and drive are the same share a row; the gain is not in it.
    """
    sub = kernel.substeps(signals.period_s)
    h = signals.period_s / sub
    _, first, row_of = np.unique(words[:, _FILTERING], axis=0, return_index=True, return_inverse=True)
    rows = np.empty((len(first), len(signals) * sub))
    sizes = compose.memory_sizes(h)
    offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(np.int64)
    for row, chosen in zip(rows, first, strict=True):
        on = active(words[chosen])
        for stretch in signals.stretches:
            memory = np.zeros(offsets[-1])
            out = row[stretch.start * sub : stretch.stop * sub]
            kernel.drive(signals.command[stretch], memory, offsets, h, sub, 0, words[chosen], on, out)
    return rows, row_of.reshape(-1).astype(np.int64)


def run_mechanics(
    drives: Floats, drive_of: Ints, begin: Ints, starts: Floats, words: Floats, h: float, sub: int, out: Floats
) -> None:
    """Run the kernel's mechanics on lanes with the narrowest code that holds their effects; see `kernel.mechanics`."""
    kernel.mechanics(
        (0,) * (1 if len(words) == 1 else kernel.WIDTH),
        *code_for(words),
        np.ascontiguousarray(drives),
        drive_of,
        begin,
        np.ascontiguousarray(starts),
        np.ascontiguousarray(words),
        h,
        sub,
        out,
    )


def code_for(words: Floats) -> tuple[tuple[int, ...] | None, bool]:
    """Return laws and dry of `kernel.mechanics`: the least code that holds all effects of words (lanes, SIZE)."""
    on = active(words)
    dry = bool(np.any(on & _STICKING))
    if not np.any(on & _MECHANICAL):
        return NO_LAWS, dry
    return ALL_LAWS if np.any(on & _MECHANICAL & _COSTLY) else PLAIN_LAWS, dry


def measured(states: Floats, words: Floats) -> Floats:
    """Return what the sensors show of true states (..., 4) of lanes with words (lanes, SIZE); lanes come first."""
    return through_sensors(states, words, measuring(words))


def unmeasured(states: Floats, words: Floats) -> Floats:
    """Return the true states behind measured ones; the inverse of `measured`."""
    effects = [replace(e, law=e.inverse) for e in reversed(measuring(words)) if e.inverse is not None]
    return through_sensors(states, words, effects)


def measuring(words: Floats) -> list[Effect]:
    """Return the sensor's effects that are on in any lane, in chain order."""
    on = active(words)
    return [e for k, e in _MEASURING if on[k]]


def through_sensors(states: Floats, words: Floats, effects: list[Effect]) -> Floats:
    """Return states after the sensor's effects; see `measured`."""
    if not effects:
        return states.copy()
    x, th, v, w = (states[..., k] for k in range(4))
    for effect in effects:
        slot = SLOTS[effect.name]
        shape = (-1,) + (1,) * (states.ndim - 2)
        x, v, th, w = effect.law(x, v, th, w, *(words[:, k].reshape(shape) for k in range(slot.start, slot.stop)))
    return np.stack([x, th, v, w], axis=-1)
