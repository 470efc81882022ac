"""Windows: pieces of equal length, each run freely from a start state that was smoothed."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.records import Noise, Windows
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.signals import Signals

WINDOW_S = 1.0


def shorten_windows(state: SmoothState, windows: Windows, pieces: int) -> Windows:
    """Cut every window into so many shorter ones, each from its own smoothed start."""
    length = (windows.samples - 1) // pieces
    begin = (windows.begin[:, None] + np.arange(pieces) * length).reshape(-1)
    return Windows(begin, length + 1, state.states[begin])


def cut_windows(
    signals: Signals, state: SmoothState, every_s: float, seconds: float = WINDOW_S
) -> Windows:
    """Cut windows that start every so often, inside their stretch, with enough valid samples."""
    length = max(round(seconds / signals.period_s), 1)
    stride = max(round(every_s / signals.period_s), 1)
    begins = [b for s in signals.stretches for b in range(s.start, s.stop - length, stride)]
    begin = np.array([b for b in begins if _has_enough(signals, b, length + 1)], dtype=np.int64)
    return Windows(begin, length + 1, state.states[begin])


def _has_enough(signals: Signals, begin: int, samples: int) -> bool:
    part = slice(begin, begin + samples)
    return all(
        float(np.mean(valid[part])) >= decisions.WINDOW_LEAST_VALID
        for values, valid in (
            (signals.cart, signals.cart_valid),
            (signals.pole, signals.pole_valid),
        )
        if values is not None
    )


def gather(signals: Signals, begin: Ints, samples: int) -> tuple[Floats, Floats]:
    """Return the measured positions in windows, and which of them count.

    begin: (windows,) first sample of each window.

    Returns values, (windows, samples, channels), m for the cart and rad for the pole; and counts
    of the same shape, 1 where a value is valid, else 0. A joint that the recording lacks has no
    channel (`list_channels`).
    """
    at = begin[:, None] + np.arange(samples)
    values, counts = [], []
    for part, valid in ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid)):
        if part is not None:
            values.append(part[at])
            counts.append(valid[at].astype(np.float64))
    return np.stack(values, axis=-1), np.stack(counts, axis=-1)


def list_channels(signals: Signals) -> tuple[int, ...]:
    """Return the positions' indices in a state (0 cart, 1 pole) that the recording holds."""
    return tuple(k for k, part in enumerate((signals.cart, signals.pole)) if part is not None)


def list_noise(noise: Noise) -> Floats:
    """Return the noise of the channels that are there, in channel order."""
    return np.array([n for n in (noise.cart_m, noise.pole_rad) if n is not None])
