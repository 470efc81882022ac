"""The phases that a next experiment is put together from: a modest family, from slow and gentle to fast and strong."""

from __future__ import annotations

import numpy as np

from pendulum_twin.plans.plan_phases import Chirp, FreeDecay, Multisine, Phase, Samples, Steps
from pendulum_twin.plans.waveforms import Envelope, compute_kick_s
from pendulum_twin.signals import Floats

STRENGTHS = (0.1, 0.25, 0.5, 1.0)  # of the limit
SWEEPS_HZ = ((0.2, 0.6), (0.5, 2.0), (2.0, 0.5), (1.5, 6.0))
HOLDS_S = (0.12, 0.45)
SWINGS = (1, 2)
PULSE_S, PAUSE_S = 0.15, 0.6
DECIMALS = 4


def list_phases(room: Envelope, seconds: float, rate_hz: float, seed: int) -> list[Phase]:
    """Return phases of so many seconds each; the seed draws tones' phases and step sizes.

    Whether the rail is long enough for one is for a simulation to say.
    """
    found: list[Phase] = []
    for strength in STRENGTHS:
        amplitude = strength * room.limit
        found += [
            Chirp(seconds=seconds, from_hz=a, to_hz=b, amplitude=amplitude)
            for a, b in SWEEPS_HZ
            if max(a, b) <= rate_hz / 4
        ]
        if rate_hz >= 4 * 3.37:
            found.append(Multisine(seconds=seconds, amplitude=amplitude, seed=seed))
        found += [
            Steps(seconds=seconds, amplitude=amplitude, hold_s=hold, seed=seed) for hold in HOLDS_S
        ]
        found += [
            FreeDecay(seconds=seconds, amplitude=amplitude, swings=swings)
            for swings in SWINGS
            if compute_kick_s(room, swings) < seconds / 2
        ]
        t = np.arange(max(2, round(seconds * rate_hz))) / rate_hz
        found += [
            _make_samples(amplitude * wave)
            for wave in (make_ramps(t, 1), make_ramps(t, 2), make_stop_and_go(t))
        ]
    return found


def make_ramps(t: Floats, periods: int) -> Floats:
    """Return slow ramps up, down and up again, -1 to 1: the cart breaks loose and comes to rest slowly."""
    return np.asarray(2 / np.pi * np.arcsin(np.sin(2 * np.pi * periods * t / (t[-1] + t[1]))))


def make_stop_and_go(t: Floats) -> Floats:
    """Return pulses there and back with pauses in which everything comes to rest."""
    phase = np.mod(t, 2 * PULSE_S + PAUSE_S)
    way = np.where(np.mod(t // (2 * PULSE_S + PAUSE_S), 2) == 0, 1.0, -1.0)
    return way * np.select([phase < PULSE_S, phase < 2 * PULSE_S], [1.0, -1.0], 0.0)


def _make_samples(commands: Floats) -> Samples:
    return Samples(commands=tuple(np.round(commands, DECIMALS).tolist()))
