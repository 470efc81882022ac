"""Recordings whose commands are in doubt: stamps that a busy computer takes late."""

from dataclasses import replace

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from support.degraded import make_raw
from support.made_recordings import INTECO, PERIOD_S, made_states

RAW = make_raw()
COUNT = len(RAW.command_stamp_s)
HELD = Twin("held", INTECO.rig, {"cart_coulomb_friction": {"level_n": 2.0}})
TAKEN_S = 0.0005  # from sending a command to its stamp, where the computer is busy


def sample_commands() -> Floats:
    """Return steps and a fast sweep, (COUNT,), PWM fraction."""
    steps = 0.3 * np.random.default_rng(8).choice([-1.0, 1.0], COUNT // 20 + 1).repeat(20)[:COUNT]
    t = PERIOD_S * np.arange(COUNT)
    return np.where(t < 10.0, steps, 0.4 * np.sin(2 * np.pi * (1.0 + 0.2 * t) * t))


def record_answers(twin: Twin, push: Floats | None = None) -> tuple[RawRecording, Floats]:
    """Return a recording, and the commands that acted, (COUNT,).

    The driver answers each sample at about the middle of the period, and one stamp in five is
    taken later than its command was sent: such a command seems to have come after the middle.

    push: (COUNT,) added to the command that moves the rig, and recorded nowhere.
    """
    random, chosen = np.random.default_rng(6), sample_commands()
    sent = RAW.command_stamp_s + PERIOD_S * random.uniform(0.3, 0.5, COUNT)
    late = random.exponential(TAKEN_S, COUNT) * (random.random(COUNT) < 0.2)
    moved = chosen if push is None else chosen + push
    cart, pole, _, _ = made_states(twin, moved).T
    noisy = cart + random.normal(0.0, 2e-5, COUNT), pole + random.normal(0.0, 3e-4, COUNT)
    stamps = np.maximum.accumulate(sent + late)
    raw = replace(RAW, cart=noisy[0], pole=noisy[1], command_stamp_s=stamps, command=chosen)
    return raw, chosen


def measure_off(case: Case, acted: Floats) -> float:
    """Return the root mean square of what is wrong about the commands, PWM fraction."""
    off = case.signals.command - acted[: len(case.signals)]
    return float(np.sqrt(np.mean(off**2)))


def exchange_some(case: Case, share: float) -> Case:
    """Return the case with other options chosen for a share of the doubtful commands."""
    doubt, random = case.recording.doubt, np.random.default_rng(3)
    assert doubt is not None
    which = np.flatnonzero(random.random(len(doubt)) < share)
    others = np.array([random.choice(np.flatnonzero(row > 0)) for row in doubt.costs[which]])
    doubt = doubt.choose(which, others)
    signals = replace(case.signals, command=doubt.put_into(case.signals.command))
    return replace(case, recording=replace(case.recording, signals=signals, doubt=doubt))
