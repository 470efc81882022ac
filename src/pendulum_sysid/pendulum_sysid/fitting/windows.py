"""Stretches of equal length, each run freely from a start state smoothed out of the recording alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.cleaning.smoothing import derivative, noise_gain, smooth
from pendulum_sysid.records import Ints, Noise, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

WINDOW_S = 1.0
LEAST_VALID = 0.5  # fraction of samples in a window


@dataclass(frozen=True)
class SmoothState:
    """Hold the smoothed states of a recording, (n, 4) measured x, th, v, w, and accelerations (n, 2).

    noise: of the sensors. deviations, acceleration_deviations: (4,) and (2,) standard deviations
    that the noise leaves in the smoothed states and accelerations.
    """

    states: Floats
    accelerations: Floats
    noise: Noise
    deviations: Floats
    acceleration_deviations: Floats


def smooth_state(signals: Signals) -> SmoothState:
    """Return the recording's states by smoothing cart and pole each for itself; a missing part stays at 0.

    Accelerations, whose noise falls with the fifth power of the length, are smoothed over longer
    ones than values, and both
    over the same length: cart and pole are coupled through them.
    """
    states, accelerations = np.zeros((len(signals), 4)), np.zeros((len(signals), 2))
    noises: list[float | None] = [None, None]
    deviations, acceleration_deviations = np.ones(4), np.zeros(2)
    parts = ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid))
    found = {
        k: (values, smooth(values, valid, signals.stretches, signals.period_s))
        for k, (values, valid) in enumerate(parts)
        if values is not None
    }
    halves = [one.half_length for _, one in found.values()]
    longer = max(2 * min(halves), max(halves))
    for k, (values, one) in found.items():
        states[:, k], states[:, k + 2] = one.value, one.rate
        accelerations[:, k] = derivative(values, signals.stretches, signals.period_s, longer, 2)
        noises[k] = one.noise
        acceleration_deviations[k] = one.scatter * noise_gain(longer, signals.period_s, 2)
        deviations[[k, k + 2]] = one.value_noise, one.rate_noise
    return SmoothState(states, accelerations, Noise(*noises), deviations, acceleration_deviations)


def shorter(state: SmoothState, windows: Windows, parts: int) -> Windows:
    """Return windows cut into so many shorter ones: the same samples, each part from its own smoothed start."""
    length = (windows.samples - 1) // parts
    begin = (windows.begin[:, None] + np.arange(parts) * length).reshape(-1)
    return Windows(begin, length + 1, state.states[begin])


def cut(
    signals: Signals, state: SmoothState, every_s: float, seconds: float = WINDOW_S
) -> Windows:
    """Return windows that start every so often and stay inside their stretch; windows with too few samples are left out."""
    length = max(round(seconds / signals.period_s), 1)
    stride = max(round(every_s / signals.period_s), 1)
    begins = [b for s in signals.stretches for b in range(s.start, s.stop - length, stride)]
    begin = np.array([b for b in begins if _enough(signals, b, length + 1)], dtype=np.int64)
    return Windows(begin, length + 1, state.states[begin])


def _enough(signals: Signals, begin: int, samples: int) -> bool:
    part = slice(begin, begin + samples)
    return all(
        float(np.mean(valid[part])) >= LEAST_VALID
        for values, valid in (
            (signals.cart, signals.cart_valid),
            (signals.pole, signals.pole_valid),
        )
        if values is not None
    )


def gather(signals: Signals, begin: Ints, samples: int) -> tuple[Floats, Floats]:
    """Return what was measured in the windows, (windows, samples, channels), and 1 where it counts, 0 where not.

    Channels are cart (m) and pole (rad), or the one that is there; see `channels`.
    """
    at = begin[:, None] + np.arange(samples)
    values, counts = [], []
    for part, valid in ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid)):
        if part is not None:
            values.append(part[at])
            counts.append(valid[at].astype(np.float64))
    return np.stack(values, axis=-1), np.stack(counts, axis=-1)


def channels(signals: Signals) -> tuple[int, ...]:
    """Return the positions' indices in a state (0 cart, 1 pole) that the recording holds."""
    return tuple(k for k, part in enumerate((signals.cart, signals.pole)) if part is not None)


def noise_of(noise: Noise) -> Floats:
    """Return the noise of the channels that are there, in channel order."""
    return np.array([n for n in (noise.cart_m, noise.pole_rad) if n is not None])
