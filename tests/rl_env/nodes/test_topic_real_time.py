"""The environment over real topics in real time, on the twin and on a made rig."""

import math
import os
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import suppress

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from support.paths import CONFIG  # noqa: E402
from support.polling import until  # noqa: E402
from support.served_twin import served_twin  # noqa: E402
from support.topic_rigs import HANGING, MadeRig, made_rig  # noqa: E402

from pendulum_bridge.nodes.view_node import ViewNode  # noqa: E402
from pendulum_rl_env.nodes import rig_client  # noqa: E402
from pendulum_rl_env.nodes.rig_client import RigClient  # noqa: E402
from pendulum_rl_env.nodes.ros_env import make_ros_env  # noqa: E402
from pendulum_rl_env.nodes.topic_transport import TopicTransport  # noqa: E402
from pendulum_rl_env.transport import NoAnswerError, Sample  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402

INTECO = CONFIG / "inteco.yaml"
REFUSED = "The reset was given up: the emergency stop is latched."
PATIENT_S = 60.0  # no machine stands still for so long
DEADLINE_S = 1.0  # for tests of the deadline itself


@pytest.fixture
def domain(ros, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    return ros


@pytest.fixture
def rig(domain) -> Iterator[MadeRig]:
    with made_rig(domain.context) as made:
        yield made


@pytest.fixture
def transport(domain) -> Iterator[TopicTransport]:
    transport = TopicTransport(deadline_s=PATIENT_S, reset_deadline_s=PATIENT_S)
    try:
        yield transport
    finally:
        transport.close()


@pytest.fixture
def hasty(domain) -> Iterator[TopicTransport]:
    """Return a transport that gives up soon."""
    transport = TopicTransport(deadline_s=DEADLINE_S, reset_deadline_s=PATIENT_S)
    try:
        yield transport
    finally:
        transport.close()


def reset_at_last(transport: TopicTransport) -> None:
    """Reset, again where a machine that stands still has missed the transport's deadline."""

    def is_reset() -> bool:
        with suppress(NoAnswerError):
            transport.reset()
            return True
        return False

    until(is_reset, "a reset", lambda: None)


def exchange_in_time(
    rig: MadeRig, transport: TopicTransport, command: float
) -> tuple[Sample, int]:
    """Return the sample of a command, and how often the machine missed the exchange's deadline.

    A machine that stands still can let the rig hear a command only after the step that the command
    was for. Such an exchange is asked again. Every sample is later than its command.
    """
    end_s, missed = time.monotonic() + 2 * PATIENT_S, 0
    while True:
        before_s = time.time()
        sample = transport.exchange(command)
        assert sample.stamp_s > before_s
        rig.wait_to_hear(command)
        if rig.heard_ns * 1e-9 < sample.stamp_s:
            return sample, missed
        assert sample.state[2] != command and time.monotonic() < end_s
        missed += 1


@pytest.fixture
def contexts(monkeypatch: pytest.MonkeyPatch) -> list[rclpy.context.Context]:
    """Return the contexts of the clients to be made."""
    made: list[rclpy.context.Context] = []

    def make_context() -> rclpy.context.Context:
        made.append(rclpy.context.Context())
        return made[-1]

    monkeypatch.setattr(rig_client, "Context", make_context)
    return made


def test_an_environment_that_cannot_be_made_leaves_no_node(domain, contexts) -> None:
    with pytest.raises(BadInputError, match="render_mode: expected human, rgb_array or None"):
        make_ros_env(render_mode="jpeg")
    assert [context.ok() for context in contexts] == [False]


def test_a_client_that_cannot_be_made_leaves_no_node(domain, contexts, monkeypatch) -> None:
    monkeypatch.setattr(rig_client, "DirectSubscription", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        RigClient("rig")
    assert [context.ok() for context in contexts] == [False]


@pytest.mark.wall_time
def test_steps_on_the_twin_are_30_ms_by_its_stamps(domain) -> None:
    with served_twin(domain, "rig", twin=str(INTECO)):
        env = make_ros_env()
        try:
            env.reset()
            infos = [
                env.step(np.array([0.2 * (-1) ** (k // 8)], dtype=np.float32))[4]
                for k in range(40)
            ]
        finally:
            env.close()
    steps_s = np.array([info["dt_s"] for info in infos])
    assert np.median(steps_s) == pytest.approx(0.03, abs=1e-6)
    assert np.allclose(steps_s / 0.01, np.round(steps_s / 0.01), atol=1e-3)  # the twin's grid
    assert all(info["latency_s"] > 0.0 for info in infos)
    assert all(info["age_s"] > -0.005 for info in infos)  # a timer may fire a little early
    assert np.median([info["age_s"] for info in infos]) > 0.0
    assert all(info["delay_s"] > -0.005 for info in infos)
    assert 0.0 < np.median([info["delay_s"] for info in infos]) < 0.03


def test_the_browser_view_shows_the_episode(domain) -> None:
    """The page shows commands and samples of an episode, as for any other user of the rig."""
    with served_twin(domain, "rig", twin=str(INTECO)):
        view, env = domain.add(ViewNode, port=0), make_ros_env()
        try:
            env.reset()
            for command in (0.3, -0.3, 0.25):
                env.step(np.array([command], dtype=np.float32))

                def shown(command: float = command) -> bool:
                    rig = view.board.take_snapshot(0.0).rig
                    return bool(
                        rig.samples
                        and rig.pwm
                        and math.isclose(rig.pwm.value, 0.5 * command, rel_tol=1e-6)
                    )

                domain.until(shown, f"the page to show {command}")
        finally:
            env.close()


def test_every_sample_is_later_than_its_command_and_shows_it(
    rig: MadeRig, transport: TopicTransport
) -> None:
    transport.reset()
    missed = 0
    for k in range(1, 30):
        sample, again = exchange_in_time(rig, transport, k / 100)
        assert sample.state[2] == k / 100
        missed += again
    assert missed < 29  # a transport that never waits for a step's end would miss them all


def test_a_late_caller_is_counted_and_survives(rig: MadeRig, transport: TopicTransport) -> None:
    assert transport.reset().info["missed"] == 0.0
    before = transport.exchange(0.1).info["missed"]
    threading.Event().wait(0.3)  # as long as an update of a policy takes
    late = transport.exchange(0.2)
    assert late.info["overrun_s"] > 0.2 and late.info["missed"] == before + 1.0
    assert exchange_in_time(rig, transport, 0.2)[0].state[2] == 0.2
    begin_s = time.monotonic()
    for _ in range(5):
        transport.exchange(0.1)
    assert time.monotonic() - begin_s > 0.1  # no burst
    assert transport.reset().info["missed"] == 0.0


def test_a_dead_rig_ends_the_step_at_the_deadline_with_pwm_0(
    rig: MadeRig, hasty: TopicTransport
) -> None:
    reset_at_last(hasty)
    rig.alive = False
    with pytest.raises(
        NoAnswerError, match=r"/rig: expected a sample later than the command within 1 s"
    ):
        for _ in range(3):  # a sample may be under way
            begin_s = time.monotonic()
            hasty.exchange(0.3)
    assert time.monotonic() - begin_s >= DEADLINE_S
    rig.wait_to_hear(0.0)


def test_a_rig_that_is_not_there_is_told_at_the_deadline(domain) -> None:
    transport = TopicTransport("nowhere", reset_deadline_s=0.5)
    try:
        begin_s = time.monotonic()
        with pytest.raises(
            NoAnswerError,
            match=r"/nowhere: .* nobody listens to /nowhere/pwm within 0.5 s: see that it runs",
        ):
            transport.reset()
        assert time.monotonic() - begin_s >= 0.5
    finally:
        transport.close()


def test_a_refused_reset_tells_why(rig: MadeRig, transport: TopicTransport) -> None:
    rig.refusal = REFUSED
    with pytest.raises(NoAnswerError, match=f"^/rig/reset: {REFUSED}$"):
        transport.reset()
    rig.refusal = ""
    assert np.array_equal(transport.reset().state, HANGING)


def test_a_rig_without_a_pole_is_no_rig_to_learn_on(rig: MadeRig, hasty: TopicTransport) -> None:
    rig.joints = ["cart"]
    with pytest.raises(
        NoAnswerError, match=r"could not be read: joint_states: expected a pole, found \['cart'\]"
    ):
        hasty.reset()


def test_a_twin_in_real_time_is_not_taken_for_one_in_lockstep(rig: MadeRig) -> None:
    transport = TopicTransport(lockstep=True)
    try:
        with pytest.raises(BadInputError, match="start twin_node with lockstep:=true"):
            transport.reset()
    finally:
        transport.close()


def test_ctrl_c_and_close_leave_pwm_0(rig: MadeRig, transport: TopicTransport) -> None:
    transport.reset()
    transport.exchange(0.4)
    rig.alive = False
    threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(KeyboardInterrupt):
        for _ in range(3):
            transport.exchange(0.4)
    rig.wait_to_hear(0.0)
    rig.alive = True
    transport.exchange(0.4)
    rig.wait_to_hear(0.4)
    transport.close()
    rig.wait_to_hear(0.0)
