"""Commands in doubt are settled by a twin that was fitted, and only by such a twin."""

from dataclasses import replace

import numpy as np
import pytest
from support.degraded import make_raw
from support.made_recordings import INTECO, PERIOD_S, made, made_states

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.command_doubt import CommandDoubt, join_doubts
from pendulum_sysid.fitting.acting_commands import settle_by_twin
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.reading.raw import RawRecording
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

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


def test_the_options_that_are_chosen_are_the_commands_of_the_recording() -> None:
    raw, _ = record_answers(HELD)
    recording = clean_recording(raw)
    doubt, command = recording.doubt, recording.signals.command
    assert doubt is not None and doubt.samples[-1] == COUNT - 1  # the last command is in doubt
    assert np.array_equal(doubt.put_into(command), command)


def test_the_twin_finds_the_samples_from_which_commands_acted() -> None:
    raw, acted = record_answers(HELD)
    case = exchange_some(prepare_case([clean_recording(raw)], HELD), 0.02)
    settled = settle_by_twin(case, make_theta(HELD))
    before, after = measure_off(case, acted), measure_off(settled, acted)
    print(f"{before:.2g} -> {after:.2g} of PWM")
    assert before > 0.005 and after < 0.3 * before
    assert settled.recording.doubt is not None
    assert np.array_equal(
        settled.signals.command, settled.recording.doubt.put_into(case.signals.command)
    )
    assert settle_by_twin(settled, make_theta(HELD)) is settled


def test_a_twin_that_lacks_physics_settles_nothing() -> None:
    raw, _ = record_answers(HELD)
    case = prepare_case([clean_recording(raw)], INTECO)
    assert settle_by_twin(case, make_theta(INTECO)) is case


def test_a_push_from_outside_is_no_command_that_acted_otherwise() -> None:
    """For 0.3 s something pushes the cart with a fifth of the drive's force."""
    t = PERIOD_S * np.arange(COUNT)
    push = np.where((t > 12.2) & (t < 12.5), 0.1, 0.0)
    raw, acted = record_answers(HELD, push)
    case = prepare_case([clean_recording(raw)], HELD)
    settled = settle_by_twin(case, make_theta(HELD))
    at = np.flatnonzero(settled.signals.command != acted[: len(settled.signals)])
    near = (t[at] > 11.7) & (t[at] < 13.0)
    print(f"{len(at)} wrong, {near.sum()} near the push")
    assert near.sum() <= 3


def test_a_recording_without_doubt_stays_as_it_is() -> None:
    recording = made(INTECO)
    assert recording.doubt is None
    case = prepare_case([recording], INTECO)
    assert settle_by_twin(case, make_theta(INTECO)) is case


@pytest.mark.parametrize("first", [True, False])
def test_doubts_of_joined_recordings_count_through(first: bool) -> None:
    few = CommandDoubt(
        np.array([3]), np.array([[0.1, 0.2]]), np.array([[0.0, 5.0]]), np.array([0])
    )
    many = CommandDoubt(
        np.array([7]), np.array([[0.3, 0.4, 0.5]]), np.array([[6.0, 0.0, 7.0]]), np.array([1])
    )
    joined = join_doubts([few, None, many] if first else [many, None, few], [10, 20, 30])
    assert joined is not None
    assert joined.samples.tolist() == ([3, 37] if first else [7, 33])
    row = 0 if first else 1
    assert joined.costs[row].tolist() == [0.0, 5.0, np.inf]
    command = joined.choose(np.array([row]), np.array([1])).put_into(np.zeros(60))
    assert command[joined.samples[row]] == 0.2 and command[joined.samples[1 - row]] == 0.4
    assert join_doubts([None, None], [10, 20]) is None
