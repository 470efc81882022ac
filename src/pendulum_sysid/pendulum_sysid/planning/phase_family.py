"""The phases that a plan is put together from, from slow and gentle to fast and strong."""

from __future__ import annotations

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.plans.plan_phases import Chirp, FreeDecay, Multisine, Phase, Samples, Steps
from pendulum_twin.plans.waveforms import Envelope, compute_kick_s

STRENGTHS = (0.1, 0.25, 0.5, 1.0)  # of the limit
SWEEPS_HZ = ((0.2, 0.6), (0.5, 2.0), (2.0, 0.5), (1.5, 6.0))
HOLDS_S = (0.12, 0.45)
SWINGS = (1, 2)
PULSE_S, PAUSE_S = 0.15, 0.6
DECIMALS = 4
SEED = 0  # of the phases of tones and the sizes of steps


def list_phases(room: Envelope, seconds: float, rate_hz: float) -> list[Phase]:
    """Return the candidate phases.

    room: limits of rail and command.
    seconds: length of each phase.
    rate_hz: rate of the plan.

    A simulation has to say whether the rail is long enough for a phase.
    """
    phases: list[Phase] = []
    for strength in STRENGTHS:
        amplitude = strength * room.limit
        phases += [
            Chirp(seconds=seconds, from_hz=a, to_hz=b, amplitude=amplitude)
            for a, b in SWEEPS_HZ
            if max(a, b) <= rate_hz / 4
        ]
        if rate_hz >= 4 * 3.37:
            phases.append(Multisine(seconds=seconds, amplitude=amplitude, seed=SEED))
        phases += [
            Steps(seconds=seconds, amplitude=amplitude, hold_s=hold, seed=SEED) for hold in HOLDS_S
        ]
        phases += [
            FreeDecay(seconds=seconds, amplitude=amplitude, swings=swings)
            for swings in SWINGS
            if compute_kick_s(room, swings) < seconds / 2
        ]
        t = np.arange(max(2, round(seconds * rate_hz))) / rate_hz
        phases += [
            _make_samples(amplitude * wave)
            for wave in (make_ramps(t, 1), make_ramps(t, 2), make_stop_and_go(t))
        ]
    return phases


def make_ramps(t: Floats, periods: int) -> Floats:
    """Return slow ramps between -1 and 1: the cart breaks loose and comes to rest slowly."""
    return np.asarray(2 / np.pi * np.arcsin(np.sin(2 * np.pi * periods * t / (t[-1] + t[1]))))


def make_stop_and_go(t: Floats) -> Floats:
    """Return pulses there and back with pauses in which everything comes to rest."""
    phase = np.mod(t, 2 * PULSE_S + PAUSE_S)
    way = np.where(np.mod(t // (2 * PULSE_S + PAUSE_S), 2) == 0, 1.0, -1.0)
    return way * np.select([phase < PULSE_S, phase < 2 * PULSE_S], [1.0, -1.0], 0.0)


def _make_samples(commands: Floats) -> Samples:
    return Samples(commands=tuple(np.round(commands, DECIMALS).tolist()))
