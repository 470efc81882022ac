"""Command and sample belong together: a driver that is off by a step fits the twin clearly worse.

The user answers every sample at once with a random command. What the driver says it applied, by
when it said so, is what
moved the rig: the twin, driven by it from rest, follows the samples; driven by the same shifted by
one sample, it does not.
"""

import random

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from sensor_msgs.msg import JointState  # noqa: E402
from support.driven_rig import MODULE, DrivenEmulator, User, arguments_for  # noqa: E402
from support.ros_graph import Graph  # noqa: E402
from support.running_emulator import TWIN  # noqa: E402

from pendulum_twin.model import load_twin  # noqa: E402
from pendulum_twin.nodes.messages import from_joint_state, from_time  # noqa: E402
from pendulum_twin.stepper import Stepper  # noqa: E402

PERIOD_S = 0.01
SAMPLES = 150
CLEARLY = 2.0


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
def recorded(ros: Graph):
    """Return stamps (s), states (n, 4), and when (s) which PWM fraction was applied."""
    emulator = DrivenEmulator()
    try:
        user, wanted = User(ros), random.Random(5)
        ros.start(
            MODULE, *arguments_for(emulator)
        )  # a program of its own: threads here would take turns with it
        user.meet()
        user.more(5)
        answers: dict[int, float] = {}

        def answer(message: JointState) -> None:
            stamp_ns = from_time(message.header.stamp)
            answers[stamp_ns] = wanted.uniform(
                -0.2, 0.2
            )  # two differ by less than the slew limit lets pass in a period
            user.send(answers[stamp_ns])

        user.node.create_subscription(JointState, "joint_states", answer, 10)
        user.until(lambda: len(answers) >= SAMPLES, "the samples")
        yield Recorded(user, answers)
    finally:
        emulator.kill()


def compute_error_m(states: np.ndarray, commands: np.ndarray) -> float:
    """Return how far the cart's second differences are from those of the twin's free run.

    The median: on a busy machine some commands miss their sample, and that shows in their own
    differences alone.
    """
    stepper = Stepper(load_twin(TWIN), PERIOD_S, tuple(states[0]))
    run = np.array([states[0], *(stepper.step(command) for command in commands[:-1])])
    return float(np.median(np.abs(np.diff(run[:, 0] - states[:, 0], 2))))


@pytest.mark.wall_time
def test_a_shift_of_one_step_between_command_and_sample_shows(recorded: Recorded) -> None:
    states, commands, answers = recorded.states, recorded.commands, recorded.answers
    assert len(states) > 0.8 * SAMPLES and np.ptp(states[:, 0]) > 0.005
    as_it_is = compute_error_m(states, commands)
    shifted = {shift: compute_error_m(states, np.roll(commands, shift)) for shift in (-1, 1)}
    assert as_it_is * CLEARLY < min(shifted.values()), (as_it_is, shifted)
    same = {shift: float(np.mean(commands == np.roll(answers, shift))) for shift in (-1, 0, 1)}
    assert same[0] > 0.2, (
        same
    )  # the answer to a sample acts from that sample on, unless a busy machine was late with it
