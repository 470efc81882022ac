"""Command and sample belong together: a driver that is off by a step fits the twin clearly worse.

The user answers every sample at once with a random command. The commands that the driver reports
as applied, by the time of the report, moved the rig: the twin, driven by them from rest, follows
the samples; driven by the same commands shifted by a sample, it does not.
"""

import random
from collections.abc import Callable, Iterator

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from sensor_msgs.msg import JointState  # noqa: E402
from support.driven_rig import MODULE, DrivenEmulator, User, arguments_for  # noqa: E402
from support.repeating import repeat_until_right  # noqa: E402
from support.ros_graph import Graph  # noqa: E402
from support.running_emulator import TWIN  # noqa: E402

from pendulum_twin.model import load_twin  # noqa: E402
from pendulum_twin.nodes.messages import from_joint_state, from_time  # noqa: E402
from pendulum_twin.stepper import Stepper  # noqa: E402

PERIOD_S = 0.01
SAMPLES = 150
CLEARLY = 2.0
PUNCTUAL_SHARE = 0.6


class Recorded:
    """Hold a recording from rest on; stamps in s, states (n, 4), commands and answers (n,) PWM.

    commands: what was in force from each sample on, the last applied within half a period after
    it. answers: what the user answered to each sample.
    """

    def __init__(self, user: User, answers: dict[int, float]) -> None:
        by_stamp = {from_time(m.header.stamp): from_joint_state(m) for m in user.states}
        times_ns, pwm = np.array(user.applied).T
        stamps_ns = np.array(
            [
                stamp
                for stamp in answers
                if stamp in by_stamp and stamp < times_ns[-1] - PERIOD_S * 1e9
            ]
        )
        self.states = np.array([by_stamp[stamp] for stamp in stamps_ns])
        self.commands = pwm[np.searchsorted(times_ns, stamps_ns + 0.5e9 * PERIOD_S) - 1]
        self.answers = np.array([answers[stamp] for stamp in stamps_ns])


@pytest.fixture
def record(ros: Graph) -> Iterator[Callable[[], Recorded]]:
    """Give a function that records SAMPLES answers from rest on."""
    emulator = DrivenEmulator()
    try:
        user, draw, answers = User(ros), random.Random(5), {}
        # a program of its own: threads here would take turns with it
        ros.start(MODULE, *arguments_for(emulator))
        user.meet()

        def answer(message: JointState) -> None:
            # two answers differ by less than the slew limit allows in a period
            stamp_ns = from_time(message.header.stamp)
            answers[stamp_ns] = draw.uniform(-0.2, 0.2)
            user.send(answers[stamp_ns])

        def record() -> Recorded:
            user.until(lambda: user.call("reset").success, "rest")
            for heard in (user.states, user.applied, answers):
                heard.clear()
            user.until(lambda: len(answers) >= SAMPLES, "the samples")
            return Recorded(user, answers)

        user.node.create_subscription(JointState, "joint_states", answer, 10)
        yield record
    finally:
        emulator.kill()


def compute_shares(recorded: Recorded) -> dict[int, float]:
    """Return the share of answers that were applied, for shifts of -1, 0 and 1 sample."""
    applied, answers = recorded.commands, recorded.answers
    return {shift: float(np.mean(applied == np.roll(answers, shift))) for shift in (-1, 0, 1)}


def is_punctual(recorded: Recorded) -> bool:
    """Tell whether most answers were applied at some common shift: no long standstill."""
    is_complete = len(recorded.states) > 0.8 * SAMPLES
    return is_complete and max(compute_shares(recorded).values()) > PUNCTUAL_SHARE


def compute_error_m(states: np.ndarray, commands: np.ndarray) -> float:
    """Return how far the cart's second differences are from those of the twin's free run.

    The median: on a busy machine some commands miss their sample, and that shows in their own
    differences alone.
    """
    stepper = Stepper(load_twin(TWIN), PERIOD_S, tuple(states[0]))
    run = np.array([states[0], *(stepper.step(command) for command in commands[:-1])])
    return float(np.median(np.abs(np.diff(run[:, 0] - states[:, 0], 2))))


@pytest.mark.wall_time
def test_a_shift_of_one_step_between_command_and_sample_shows(record) -> None:
    recorded = repeat_until_right(record, is_punctual)
    states, commands, shares = recorded.states, recorded.commands, compute_shares(recorded)
    assert np.ptp(states[:, 0]) > 0.005
    assert max(shares, key=shares.get) == 0, shares
    unshifted = compute_error_m(states, commands)
    shifted = {shift: compute_error_m(states, np.roll(commands, shift)) for shift in (-1, 1)}
    assert unshifted * CLEARLY < min(shifted.values()), (unshifted, shifted)
