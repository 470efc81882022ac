"""What keeps the excitation from beginning and what stops it, over real topics, with a last 0."""

import math
import re
from functools import partial
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Bool, Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.excitation_bench import (  # noqa: E402
    BUSY_S,
    LONG,
    PERIOD_NS,
    PUSHED,
    TWIN,
    Bench,
    StepRig,
    make,
    written,
)
from support.ros_graph import Graph  # noqa: E402

from pendulum_bridge.excitation.guard import StopReason  # noqa: E402
from pendulum_bridge.nodes.excitation_node import ExcitationNode  # noqa: E402
from pendulum_twin.model import Twin, load_twin, save_twin  # noqa: E402
from pendulum_twin.nodes.messages import to_joint_state  # noqa: E402
from pendulum_twin.nodes.qos import LATCHED, SAMPLES  # noqa: E402
from pendulum_twin.plans.plan_phases import Push, Rest  # noqa: E402


@pytest.fixture
def planned(tmp_path):
    """Return what writes a plan file of phases and returns its path."""
    return partial(written, tmp_path)


def test_a_rig_that_is_not_there_is_named(ros: Graph, planned) -> None:
    node = make(ros, planned(*LONG), ready_timeout_s=0.5)
    ros.until(lambda: node.over, "the end")
    assert (
        "no samples on /rig/joint_states: does the driver run, and is the rig on?, after 0.5 s"
        in node.end()
    )


def test_a_wait_says_for_what(
    ros: Graph, planned, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """A twin that compiles first, on a busy computer, needs half a minute."""
    monkeypatch.setattr("pendulum_bridge.nodes.excitation_reports.LOG_S", 0.1)
    node, said = make(ros, planned(*LONG)), ""

    def is_told() -> bool:
        nonlocal said
        said += capfd.readouterr().err
        return "still waits: no samples on /rig/joint_states" in said

    ros.until(is_told, "what the plan waits for")
    assert not node.over
    node.end()


def test_who_only_listens_to_the_twin_s_commands_is_no_twin(ros: Graph, planned) -> None:
    """A recorder listens to them, and begins before a twin that compiles first."""
    rig = ros.user("rig", "/rig")
    rig.create_subscription(Float64, "pwm", lambda _: None, 1)
    ros.user("recorder").create_subscription(Float64, "/twin/pwm", lambda _: None, 1)
    states = rig.create_publisher(JointState, "joint_states", SAMPLES)
    applied = rig.create_publisher(Float64, "applied_pwm", SAMPLES)
    node = make(ros, planned(*LONG), reset_first=False)

    def is_told() -> bool:
        states.publish(to_joint_state(["cart", "pole"], np.array([0.0, np.pi, 0.0, 0.0]), 1))
        applied.publish(Float64())
        return "nobody publishes /twin/joint_states" in node._find_lacking()

    ros.until(is_told, "what the plan waits for")
    node.end()


def test_a_reset_that_fails_gives_its_reason(
    ros: Graph, planned, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(ros)
    monkeypatch.setattr(bench.rig._live, "reset", lambda *_: 1 / 0)
    node = bench.play(planned(*LONG))
    assert "The reset before the plan failed (/rig: ZeroDivisionError" in node.end()
    assert set(bench.sent["/rig"]) == {0.0}


def test_a_reset_that_never_answers_has_a_deadline(ros: Graph, planned) -> None:
    rig = StepRig(ros)
    helpers = [ros.user(f"resets{k}") for k in range(2)]
    helpers[0].create_service(Trigger, "/twin/reset", lambda _, response: response)
    helpers[1].create_service(Trigger, "/rig/reset", lambda _, response: response)
    ros.executor.remove_node(helpers[0])
    node = make(ros, planned(*LONG), reset_timeout_s=0.3)
    rig.look(node)
    ros.until(lambda: node.over, "the end")
    assert "(/twin: no answer within 0.3 s)" in node.end()


def over_limit(tmp_path: Path) -> Path:
    """Return a rig that obeys a tenth of the limit."""
    twin = load_twin(TWIN)
    save_twin(
        Twin("weak", type(twin.rig)(**{**twin.rig.to_mapping(), "pwm_limit": 0.05})),
        tmp_path / "weak.yaml",
    )
    return tmp_path / "weak.yaml"


def stuck(tmp_path: Path) -> Path:
    """Return a rig whose cart does not move."""
    save_twin(
        Twin("stuck", load_twin(TWIN).rig, {"cart_coulomb_friction": {"level_n": 8.0}}),
        tmp_path / "stuck.yaml",
    )
    return tmp_path / "stuck.yaml"


BOUNDS = [
    (
        TWIN,
        PUSHED,
        {"rail_share": 0.05},
        StopReason.CART_TOO_FAR,
        r"0\.0\d+ m from the middle, at most 0.045 m",
    ),
    (
        TWIN,
        PUSHED,
        {"cart_limit_m_s": 0.2},
        StopReason.CART_TOO_FAST,
        r"0\.\d+ m/s, at most 0.2 m/s",
    ),
    (
        TWIN,
        PUSHED,
        {"pole_limit_rad_s": 0.3},
        StopReason.POLE_TOO_FAST,
        r"rad/s, at most 0.3 rad/s",
    ),
    (over_limit, PUSHED, {"overruled_s": 0.3}, StopReason.OVERRULED, r"asked for 0.3, sent 0.05"),
    (stuck, Push(), {}, StopReason.NOT_MOVED, r"it moved by 0 mm"),
]


@pytest.mark.parametrize(
    ("rig", "phase", "values", "reason", "detail"),
    BOUNDS,
    ids=lambda parameter: getattr(parameter, "name", ""),
)
def test_a_limit_stops_the_plan(
    ros: Graph, planned, tmp_path, rig, phase, values, reason, detail
) -> None:
    bench = Bench(ros, rig if isinstance(rig, Path) else rig(tmp_path))
    node = bench.play(planned(phase), **values)
    assert bench.over(node) is reason
    assert re.search(detail, node.end())


def test_a_rig_at_another_rate_is_refused(ros: Graph, planned) -> None:
    bench = Bench(ros, rig_rate_hz=50.0)
    assert bench.over(bench.play(planned(*LONG))) is StopReason.RATE_WRONG


class Events:
    """What may happen to a rig while a plan is played."""

    @staticmethod
    def stop(bench: Bench, node: ExcitationNode) -> None:
        bench.user.create_publisher(Bool, "/rig/stopped", LATCHED).publish(Bool(data=True))

    @staticmethod
    def error(bench: Bench, node: ExcitationNode) -> None:
        status = DiagnosticStatus(
            level=DiagnosticStatus.ERROR, name="/rig/driver", message="the rig burns"
        )
        diagnostics = bench.user.create_publisher(DiagnosticArray, "/diagnostics", SAMPLES)
        bad = DiagnosticArray(status=[status])  # for a second after the start it is not believed
        bench.ros.until(lambda: diagnostics.publish(bad) or node.over, "the end")

    @staticmethod
    def not_a_number(bench: Bench, node: ExcitationNode) -> None:
        states = bench.user.create_publisher(JointState, "/rig/joint_states", SAMPLES)
        bad = JointState(name=["cart", "pole"], position=[math.nan, 3.0], velocity=[0.0, 0.0])
        bench.ros.until(lambda: states.publish(bad) or node.over, "the end")

    @staticmethod
    def no_cart(bench: Bench, node: ExcitationNode) -> None:
        states = bench.user.create_publisher(JointState, "/rig/joint_states", SAMPLES)
        bad = JointState(name=["pole"], position=[3.0], velocity=[0.0])
        bench.ros.until(lambda: states.publish(bad) or node.over, "the end")

    @staticmethod
    def clock_set_back(bench: Bench, node: ExcitationNode) -> None:
        states = bench.user.create_publisher(JointState, "/rig/joint_states", SAMPLES)
        bench.ros.until(
            lambda: node._run.performance.playback.sample >= 0, "a sample that is answered"
        )
        old = to_joint_state(["cart", "pole"], np.array([0.0, np.pi, 0.0, 0.0]), PERIOD_NS)
        bench.ros.until(lambda: states.publish(old) or node.over, "the end")

    @staticmethod
    def silence(bench: Bench, node: ExcitationNode) -> None:
        bench.ros.executor.remove_node(bench.rig)

    @staticmethod
    def abort(bench: Bench, node: ExcitationNode) -> None:
        assert bench.ros.call(bench.user.create_client(Trigger, "abort")).success


EVENTS = [
    (Events.stop, StopReason.EMERGENCY_STOP, r"The emergency stop is latched\."),
    (Events.error, StopReason.DRIVER_ERROR, r"The driver reports an error \(the rig burns\)"),
    (
        Events.not_a_number,
        StopReason.SAMPLE_MALFORMED,
        r"joint_states: expected finite numbers, found \[nan",
    ),
    (
        Events.no_cart,
        StopReason.SAMPLE_MALFORMED,
        r"expected a joint named cart, found \['pole'\]",
    ),
    (
        Events.clock_set_back,
        StopReason.CLOCK_SET_BACK,
        r"expected stamps that go on, found one [\d.e+]+ s before the last: see that nothing sets",
    ),
    (Events.silence, StopReason.SAMPLES_MISSING, r"no new one for [\d.]+ s, at most 0.8 s"),
    (Events.abort, StopReason.ABORTED, r"\(plays (push|rest): \d\.\d s of 60.9 s"),
]


@pytest.mark.parametrize(
    ("event", "reason", "sentence"),
    EVENTS,
    ids=lambda parameter: getattr(parameter, "__name__", ""),
)
def test_an_event_stops_the_plan(
    ros: Graph, planned, event, reason: StopReason, sentence: str
) -> None:
    bench = Bench(ros)
    node = bench.play(planned(*LONG), silence_s=0.8 if event is Events.silence else BUSY_S)
    event(bench, node)
    assert bench.over(node) is reason
    assert re.search(sentence, node.end())


def test_another_nodes_error_does_not_stop_it(ros: Graph, planned) -> None:
    bench = Bench(ros)
    status = DiagnosticStatus(level=DiagnosticStatus.ERROR, name="/twin/twin", message="no matter")
    diagnostics = bench.user.create_publisher(DiagnosticArray, "/diagnostics", SAMPLES)
    node = bench.play(planned(Rest(seconds=1.5)))
    ros.until(
        lambda: diagnostics.publish(DiagnosticArray(status=[status])) or node.over, "the end"
    )
    assert bench.over(node) is None


def test_a_latched_stop_from_before_keeps_it_from_beginning(ros: Graph, planned) -> None:
    bench = Bench(ros)
    node = make(ros, planned(*LONG), reset_first=False, start="service")
    stop, latched = bench.user.create_publisher(Bool, "/rig/stopped", LATCHED), Bool(data=True)
    ros.until(lambda: stop.publish(latched) or node._emergency, "the latched stop")
    answer = ros.call(bench.user.create_client(Trigger, "start"))
    assert answer.success
    ros.until(lambda: stop.publish(latched) or node.over, "the end")
    assert node._run.stopped.reason is StopReason.EMERGENCY_STOP and bench.sent["/rig"] == []


def test_a_failing_callback_stops_the_plan(
    ros: Graph, planned, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(ros)
    node = bench.play(planned(*LONG))
    monkeypatch.setattr("pendulum_bridge.nodes.excitation_node.take_sample", lambda *_: 1 / 0)
    assert bench.over(node) is StopReason.FAILED
