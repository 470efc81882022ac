"""Commands in doubt are settled by a twin that was fitted, and only by such a twin."""

import numpy as np
import pytest
from support.doubtful_commands import COUNT, HELD, exchange_some, measure_off, record_answers
from support.made_recordings import INTECO, PERIOD_S, made

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.command_doubt import CommandDoubt, join_doubts
from pendulum_sysid.fitting.acting_commands import settle_by_twin
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.parameter_vector import make_theta


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
