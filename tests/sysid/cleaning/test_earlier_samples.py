"""Commands that come late, in recordings that are joined: none acts in another recording."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, PERIOD_S, made_states

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.acting_samples import Balance
from pendulum_sysid.cleaning.cart_balance import make_second_differences
from pendulum_sysid.cleaning.drive_curve import DriveCurve
from pendulum_sysid.cleaning.earlier_samples import delay_samples, find_earlier_samples
from pendulum_sysid.cleaning.slips import list_drives
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.signals import Signals, join_signals

SEAM = 600


def make_recording(seed: int) -> Signals:
    """Return the end of a run: the cart moves from the first sample on."""
    command = np.array(make_standard_plan(seconds=40, seed=seed).commands)
    states = made_states(INTECO, command)[-SEAM:]
    every = np.ones(SEAM, dtype=bool)
    return Signals(PERIOD_S, command[-SEAM:], states[:, 0], states[:, 1], every, every)


def make_joined_pair() -> tuple[Signals, Signals]:
    """Return two recordings joined, and the same with another command in the first of them."""
    joined = join_signals([make_recording(1), make_recording(2)])
    assert joined.stretch_begins == (0, SEAM)
    other = joined.command.copy()
    other[:SEAM] = np.linspace(0.3, -0.9, SEAM)
    return joined, replace(joined, command=other)


def test_the_first_sample_of_a_stretch_holds_before_it() -> None:
    values = np.array([1.0, 2.0, 3.0, 10.0, 20.0, 30.0])
    assert delay_samples(values, 2, (0, 3)).tolist() == [1.0, 1.0, 1.0, 10.0, 10.0, 10.0]
    assert delay_samples(values, 0, (0, 3)).tolist() == values.tolist()
    table = find_earlier_samples(np.array([[2], [4]]), np.array([0, 1, 9]), (0, 3))
    assert table.tolist() == [[2, 1, 0], [4, 3, 3]]


def test_answers_of_a_stretch_know_no_command_of_the_stretch_before() -> None:
    joined, other = make_joined_pair()
    second = make_second_differences(joined, smooth_state(joined))
    later = second.rows >= SEAM
    answers, others = (second.list_answers(s.command)[later] for s in (joined, other))
    assert np.any(second.rows[later] < SEAM + 10) and np.array_equal(answers, others)


def test_a_slip_is_looked_for_beside_the_commands_of_its_own_stretch() -> None:
    joined, other = make_joined_pair()
    motion = smooth_state(joined)
    late = -2 - len(decisions.SLIP_LATE_S)  # behind them stand the two gains that change
    drives, others = (list_drives(s.command, s, motion)[SEAM:, late:] for s in (joined, other))
    assert np.array_equal(drives, others)


def make_balance(late: int) -> Balance:
    """Return a balance of two stretches with nothing beside a drive that gives what it is told."""
    count = 2 * SEAM
    ends = np.array([-1.0, 0.0, 1.0])
    rows = np.setdiff1d(np.arange(1, count - 1), [SEAM - 1, SEAM])
    target = np.random.default_rng(1).normal(size=len(rows))
    slow = np.zeros(count, dtype=bool)
    curve = DriveCurve(ends, ends)
    return Balance(rows, np.empty((len(rows), 0)), target, curve, late, slow, (0, SEAM))


@pytest.mark.parametrize("samples", [slice(SEAM - 3, SEAM), slice(2 * SEAM - 3, 2 * SEAM)])
def test_the_last_commands_of_a_stretch_explain_nothing_in_a_stretch(samples: slice) -> None:
    """They act 3 samples late: after the seam, and not at the start of the recording either."""
    command = np.zeros(2 * SEAM)
    command[samples] = 0.7
    balance = make_balance(late=3)
    left, per_drive = balance.explain(command)
    assert per_drive == 0.0 and np.array_equal(left, balance.target)


@pytest.mark.parametrize("sample", [SEAM - 2, 2 * SEAM - 2])
def test_a_command_that_acts_after_the_end_of_its_stretch_is_not_judged(sample: int) -> None:
    balance = make_balance(late=3)
    command = np.random.default_rng(2).uniform(-0.9, 0.9, 2 * SEAM)
    options = np.array([[0.4, -0.4], [0.4, -0.4]])
    samples = np.array([sample - 20, sample])
    doubt = CommandDoubt(samples, options, np.zeros((2, 2)), np.zeros(2, dtype=np.int64))
    gains = balance.weigh(doubt.put_into(command), doubt)
    assert np.any(gains[0] != 0.0) and np.all(gains[1] == 0.0)
