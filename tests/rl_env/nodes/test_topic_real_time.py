"""The environment over real topics in real time, on the twin and on a made rig."""

import math
import os
import signal
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from support.paths import CONFIG  # noqa: E402
from support.served_twin import served_twin  # noqa: E402
from support.topic_rigs import HANGING, MadeRig, made_rig  # noqa: E402

from pendulum_bridge.nodes.view_node import ViewNode  # noqa: E402
from pendulum_rl_env.nodes.ros_env import make_ros_env  # noqa: E402
from pendulum_rl_env.nodes.topic_transport import TopicTransport  # noqa: E402
from pendulum_rl_env.transport import NoAnswerError  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402

INTECO = CONFIG / "inteco.yaml"
REFUSED = "The reset was given up: the emergency stop is latched."


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
    made = TopicTransport(deadline_s=0.5, reset_deadline_s=20.0)
    try:
        yield made
    finally:
        made.close()


def test_steps_on_the_twin_are_30_ms_by_its_stamps(domain) -> None:
    with served_twin(domain, "rig", twin=str(INTECO)):
        env = make_ros_env()
        try:
            env.reset()
            told = [
                env.step(np.array([0.2 * (-1) ** (k // 8)], dtype=np.float32))[4]
                for k in range(40)
            ]
        finally:
            env.close()
    steps = np.array([each["dt_s"] for each in told])
    assert np.median(steps) == pytest.approx(0.03, abs=1e-6)
    assert np.allclose(steps / 0.01, np.round(steps / 0.01), atol=1e-3)  # of the twin's even grid
    assert steps.sum() == pytest.approx(1.2 + told[-1]["missed"] * 0.03, abs=0.5)
    assert all(each["latency_s"] > 0.0 for each in told)
    assert all(each["age_s"] > -0.005 for each in told)  # a timer may fire a little early
    assert np.median([each["age_s"] for each in told]) > 0.0


def test_the_browser_view_shows_the_episode(domain) -> None:
    """The page shows commands and samples of an episode, as for any other user of the rig."""
    with served_twin(domain, "rig", twin=str(INTECO)):
        view, env = domain.add(ViewNode, port=0), make_ros_env()
        try:
            env.reset()
            for command in (0.3, -0.3, 0.25):
                env.step(np.array([command], dtype=np.float32))

                def shown(command: float = command) -> bool:
                    rig = view.board.snapshot(0.0).rig
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
    for k in range(1, 30):
        before_s = time.time()
        sample = transport.exchange(k / 100)
        assert sample.stamp_s > before_s and sample.state[2] == k / 100


def test_a_late_caller_is_counted_and_survives(rig: MadeRig, transport: TopicTransport) -> None:
    assert transport.reset().info["missed"] == 0.0
    before = transport.exchange(0.1).info["missed"]
    threading.Event().wait(0.3)  # gradients
    late = transport.exchange(0.2)
    assert (
        late.info["overrun_s"] > 0.25
        and late.info["missed"] == before + 1.0
        and late.state[2] == 0.2
    )
    begin = time.monotonic()
    for _ in range(5):
        transport.exchange(0.1)
    assert time.monotonic() - begin > 0.1  # no burst
    assert transport.reset().info["missed"] == 0.0


def test_a_dead_rig_ends_the_step_at_the_deadline_with_pwm_0(
    rig: MadeRig, transport: TopicTransport
) -> None:
    transport.reset()
    transport.exchange(0.3)
    rig.alive = False
    with pytest.raises(
        NoAnswerError, match=r"/rig: expected a sample later than the command within 0.5 s"
    ):
        for _ in range(3):  # a sample may be under way
            begin = time.monotonic()
            transport.exchange(0.3)
    assert 0.5 <= time.monotonic() - begin < 1.5
    rig.hears(0.0)


def test_a_rig_that_is_not_there_is_told_at_the_deadline(domain) -> None:
    transport = TopicTransport("nowhere", reset_deadline_s=0.5)
    try:
        begin = time.monotonic()
        with pytest.raises(
            NoAnswerError,
            match=r"/nowhere: .* nobody listens to /nowhere/pwm within 0.5 s: see that it runs",
        ):
            transport.reset()
        assert 0.5 <= time.monotonic() - begin < 2.0
    finally:
        transport.close()


def test_a_refused_reset_tells_why(rig: MadeRig, transport: TopicTransport) -> None:
    rig.refusal = REFUSED
    with pytest.raises(NoAnswerError, match=f"^/rig/reset: {REFUSED}$"):
        transport.reset()
    rig.refusal = ""
    assert np.array_equal(transport.reset().state, HANGING)


def test_a_rig_without_a_pole_is_no_rig_to_learn_on(
    rig: MadeRig, transport: TopicTransport
) -> None:
    rig.joints = ["cart"]
    with pytest.raises(
        NoAnswerError, match=r"could not be read: joint_states: expected a pole, found \['cart'\]"
    ):
        transport.reset()


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
    rig.hears(0.0)
    rig.alive = True
    transport.exchange(0.4)
    rig.hears(0.4)
    transport.close()
    rig.hears(0.0)
