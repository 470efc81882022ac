"""The driver over real topics, at the rig emulator: samples, commands, limits, watchdog, reset."""

import math
import re
import signal
import time
from collections.abc import Iterator

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from rclpy.parameter import Parameter  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from support.driven_rig import DrivenEmulator, User, figures, make_driver  # noqa: E402
from support.ros_graph import Graph, until  # noqa: E402
from support.running_emulator import TWIN  # noqa: E402

from pendulum_bridge.driver import driver as core  # noqa: E402
from pendulum_bridge.nodes.driver_node import DriverNode  # noqa: E402
from pendulum_bridge.safety.reasons import Reason  # noqa: E402
from pendulum_bridge.safety.two_writers import TOGETHER_S  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402
from pendulum_twin.nodes.qos import LATCHED  # noqa: E402

OK, WARN, ERROR = 0, 1, 2
PATIENT_S = 60.0  # the longest that the driver takes: no silence of a busy machine decides


@pytest.fixture(scope="module")
def shared() -> Iterator[DrivenEmulator]:
    """Give one emulator to all tests of this module, wherever the last one left it."""
    emulator = DrivenEmulator()
    yield emulator
    emulator.kill()


@pytest.fixture
def driven(ros: Graph, shared: DrivenEmulator):
    """Give a driver in this process that bears a machine which stands still, and its user."""
    patient = {"rig_timeout_s": PATIENT_S, "command_timeout_s": PATIENT_S}
    return meet(ros, shared, reset_deadline_s=2 * PATIENT_S, **patient)


@pytest.fixture
def alert(ros: Graph, shared: DrivenEmulator):
    """Give a driver that soon misses samples and commands, and its user."""
    return meet(ros, shared, rig_timeout_s=1.0, command_timeout_s=0.5)


def meet(ros: Graph, rig: DrivenEmulator, **values: float) -> tuple[DriverNode, User]:
    """Start a driver and its user, and return both once they hear one another."""
    node, user = make_driver(ros, rig, **values), User(ros)
    user.meet()
    return node, user


def stamps_ns(user: User) -> np.ndarray:
    return np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in user.states])


def test_samples_come_in_order_with_the_contracts_names_and_a_command_moves_the_cart(
    driven,
) -> None:
    _, user = driven
    user.states.clear()
    user.more(30)
    start = user.states[-1].position[0]
    user.holding(
        0.2,
        lambda: user.states[-1].position[0] > start + 0.02,
        "the cart to move the positive way",
    )
    message = user.states[-1]
    assert list(message.name) == ["cart", "pole"] and message.velocity[0] > 0
    assert abs(message.position[1] - math.pi) < 1.5  # hangs, or swings about it
    steps = np.diff(stamps_ns(user))
    assert np.all(steps > 0) and np.median(steps) == pytest.approx(1e7, rel=0.3)
    now = user.node.get_clock().now().nanoseconds
    assert -120e9 < stamps_ns(user)[-1] - now <= 0.01e9
    assert 0.2 in [pwm for _, pwm in user.applied]
    user.until(lambda: user.healths, "the diagnostics")
    health = user.healths[-1]
    assert (health.name, health.hardware_id) == ("/driver", "inteco")
    assert any(
        pair.key == "link" and f":{driven[0].settings.rig_port}," in pair.value
        for pair in health.values
    )


@pytest.mark.wall_time
def test_limit_and_slew_are_kept_whatever_is_commanded_and_may_change_while_it_runs(
    driven,
) -> None:
    node, user = driven
    user.call("reset")
    done = node.set_parameters_atomically(
        [Parameter("pwm_limit", value=0.1), Parameter("slew_per_s", value=1)]
    )
    assert done.successful
    user.more(1)
    user.applied.clear()
    for sign in (1, -1, 1, -1):
        user.hold(sign * 9.0, 25)
    times, pwm = np.array(user.applied).T
    assert np.max(np.abs(pwm)) == pytest.approx(0.1)
    edges = np.flatnonzero(
        np.diff(np.sign(np.where(np.abs(pwm) < 0.0999, 0.0, pwm)))
    )  # where a limit is left or reached
    assert (
        np.max(np.diff(times[edges])) > 0.1e9
    )  # 0.2 s from one to the other; a busy machine may show less of it
    assert np.count_nonzero(np.abs(pwm) < 0.09) > 10
    assert not node.set_parameters([Parameter("pwm_limit", value=math.nan)])[0].successful
    refused = node.set_parameters_atomically(
        [Parameter("pwm_limit", value=0.3), Parameter("slew_per_s", value=-1.0)]
    )
    assert not refused.successful and "slew_per_s" in refused.reason
    assert node.get_parameter("pwm_limit").value == 0.1 and node.settings.pwm_limit == 0.1


def test_the_limit_that_holds_is_said_to_who_comes_late(driven) -> None:
    node, user = driven
    said: list[float] = []
    user.node.create_subscription(Float64, "pwm_limit", lambda m: said.append(m.data), LATCHED)
    user.until(lambda: said == [0.5], "the limit")
    node.set_parameters([Parameter("pwm_limit", value=0.1)])
    user.until(lambda: said[-1] == 0.1, "the new limit")
    node.set_parameters([Parameter("pwm_limit", value=1.0)])
    user.until(lambda: said[-1] == 0.5, "the twin file's limit, which is lower")


def test_a_learner_that_pauses_lets_the_rig_stand_and_goes_on_later(alert) -> None:
    _, user = alert
    user.holding(0.01, lambda: user.pwm == 0.01, "the command")
    health = user.told(Reason.COMMAND_OLD.sentence, ERROR)
    assert user.pwm == 0.0 and figures(health)["applied_pwm"] == 0.0
    user.holding(0.02, lambda: user.pwm == 0.02, "the next command")


def test_a_silent_rig_gets_0_and_no_reset_until_it_speaks_again(
    alert, shared: DrivenEmulator
) -> None:
    _, user = alert
    user.holding(0.01, lambda: user.pwm == 0.01, "the command")
    shared.process.send_signal(signal.SIGSTOP)
    try:
        user.holding(0.01, lambda: user.pwm == 0.0, "PWM 0")
        assert user.told(Reason.RIG_SILENT.sentence, ERROR)
        answer = user.call("reset")
        assert not answer.success and answer.message == Reason.RESET_SILENT.sentence
    finally:
        shared.process.send_signal(signal.SIGCONT)
    user.holding(0.01, lambda: user.pwm == 0.01, "the command once more")


def test_a_stop_is_cleared_without_a_commander(ros: Graph, shared: DrivenEmulator) -> None:
    _, user = meet(ros, shared, rig_timeout_s=PATIENT_S)
    assert user.call("stop").success
    ros.until(
        lambda: user.call("clear_stop").message == Reason.STOP_CLEARED.sentence,
        "silence, which counts as 0",
    )


def test_the_stop_latches_and_clearing_needs_a_command_of_0_first(driven) -> None:
    _, user = driven
    user.holding(0.01, lambda: user.pwm == 0.01, "the command")
    user.until(lambda: user.stopped == [False], "the state")
    answer = user.call("stop")
    assert answer.success and answer.message == Reason.STOPPED.sentence
    user.until(lambda: user.stopped[-1], "the state")
    late = User(user.ros)
    late.until(lambda: late.stopped == [True], "the state for who comes late")
    answered_ns = time.time_ns()
    user.hold(0.3, 5)
    assert user.call("clear_stop").message == Reason.ZERO_FIRST.sentence
    user.hold(0.0, 2)
    assert user.call("clear_stop").message == Reason.STOP_CLEARED.sentence
    cleared_ns = time.time_ns()
    user.until(lambda: user.applied[-1][0] > cleared_ns, "a decision after that")
    assert {pwm for at_ns, pwm in user.applied if at_ns > answered_ns} == {
        0.0
    }  # what was commanded meanwhile is never sent
    user.holding(0.01, lambda: user.pwm == 0.01, "a new command")
    answer = user.call("clear_stop")
    assert answer.success and answer.message == Reason.NOT_STOPPED.sentence


def test_reset_brings_the_pendulum_to_rest_in_the_middle(driven) -> None:
    _, user = driven
    for k in range(70):
        user.hold(0.3 * math.copysign(1.0, math.sin(0.09 * k)), 1)
    answer = user.call("reset")
    assert answer.success and answer.message == Reason.RESET_DONE.sentence

    def rests() -> bool:
        cart, pole = user.states[-1].position
        return abs(cart) < 0.03 and abs(math.remainder(pole - math.pi, math.tau)) < 0.05

    # samples and commands from before the answer may still be on their way
    user.until(rests, "rest in the middle")
    user.until(lambda: user.pwm == 0.0, "PWM 0")
    user.more(3)
    assert rests() and user.pwm == 0.0


def test_a_stop_ends_a_reset_and_everything_is_served_meanwhile(driven) -> None:
    _, user = driven
    user.call("reset")
    user.holding(0.2, lambda: abs(user.states[-1].position[0]) > 0.1, "motion")
    first, second = user.ask("reset"), user.ask("reset")
    user.hold(0.0, 5)  # commands are served, and dropped
    assert not first.done()
    assert user.call("stop").success
    user.until(lambda: first.done() and second.done(), "the answers")
    assert {first.result().message, second.result().message} == {Reason.RESET_STOPPED.sentence}
    answer = user.call("reset")
    assert not answer.success and answer.message == Reason.RESET_STOPPED.sentence
    assert user.told(Reason.STOPPED.sentence, WARN)


def test_a_reset_that_takes_too_long_says_so(ros: Graph, shared: DrivenEmulator) -> None:
    user = User(ros)
    weak = {
        "pwm_limit": 0.02,
        "slew_per_s": 1,
        "reset_deadline_s": 1,
    }  # too weak to be quick; ints are numbers too
    make_driver(ros, shared, rig_timeout_s=PATIENT_S, **weak)
    user.meet()
    user.holding(0.02, lambda: abs(user.states[-1].position[0]) > 0.15, "a way from the middle")
    answer = user.call("reset")
    assert not answer.success and answer.message == Reason.RESET_LATE.sentence


def test_what_is_no_number_is_refused_and_counted(driven) -> None:
    node, user = driven
    user.holding(0.01, lambda: user.pwm == 0.01, "the command")
    for bad in (math.nan, math.inf, -math.inf):
        before = node.driver.counts.commands
        user.holding(
            bad, lambda before=before: node.driver.counts.commands > before, "the refusal"
        )
    user.holding(0.02, lambda: user.pwm == 0.02, "a good command")
    assert all(math.isfinite(pwm) for _, pwm in user.applied)
    user.healths.clear()
    user.until(
        lambda: user.healths and figures(user.healths[-1])["commands_refused"] >= 3, "the count"
    )


def test_two_writers_get_0_until_one_falls_silent(driven) -> None:
    node, user = driven
    user.holding(0.01, lambda: user.pwm == 0.01, "the command")
    other = user.writer(user.ros.user("other"))
    user.until(other.get_subscription_count, "discovery")
    user.hold(0.01, 20)
    assert node.driver.counts.of_two_writers == 0  # one that only exists does no harm

    def both() -> None:
        user.send(0.01)
        other.publish(Float64(data=0.3))
        for _ in range(8):  # so that what was sent is read before more is sent
            user.ros.spin()

    user.healths.clear()
    until(
        lambda: any(h.message == Reason.TWO_WRITERS.sentence for h in user.healths),
        "the diagnosis",
        both,
    )
    for _ in range(10):
        both()
    last_ns = time.time_ns()
    user.holding(0.02, lambda: user.pwm == 0.02, "the one that is left")
    first_ns = next(at_ns for at_ns, pwm in user.applied if pwm == 0.02)
    assert first_ns - last_ns > 0.9e9 * TOGETHER_S


def test_failing_callbacks_and_decisions_bring_0_and_the_node_lives_on(
    driven, monkeypatch: pytest.MonkeyPatch
) -> None:
    node, user = driven
    for where, name in ((node.driver, "command"), (core, "decide")):
        user.holding(0.01, lambda: user.pwm == 0.01, "the command")
        with monkeypatch.context() as broken:
            broken.setattr(where, name, lambda *_: 1 / 0)
            user.holding(0.01, lambda: user.pwm == 0.0, "PWM 0")
        assert user.told(Reason.FAILED.sentence, ERROR)
    user.holding(0.01, lambda: user.pwm == 0.01, "the command once more")
    monkeypatch.setattr(node.driver, "reset", lambda *_: 1 / 0)
    assert not user.call("reset").success
    user.holding(0.01, lambda: user.pwm == 0.01, "the command after all")


def test_over_tcp_it_is_the_same_and_a_rig_that_is_not_there_is_said_so(ros: Graph) -> None:
    emulator, user = DrivenEmulator(tcp=True), User(ros)
    try:
        make_driver(ros, emulator, transport="tcp", rig_timeout_s=PATIENT_S)
        user.meet()
        user.holding(0.2, lambda: user.states[-1].position[0] > 0.02, "the cart to move")
        assert user.call("stop").success
        user.until(lambda: user.pwm == 0.0, "PWM 0")
    finally:
        emulator.kill()
    assert f":{emulator.rig_port}" in user.told("", ERROR).message


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"rate_hz": math.nan}, "rate_hz: expected a number from 10 to 1000, found nan"),
        ({"pwm_limit": 0.0}, "pwm_limit: expected a number from 0.001 to 1, found 0"),
        ({"slew_per_s": "fast"}, "slew_per_s: expected a number, found 'fast'"),
        ({"transport": "serial"}, "transport: expected one of udp, tcp, found 'serial'"),
        ({"rig_port": 70000}, "rig_port: expected a whole number from 1 to 65535, found 70000"),
        (
            {"rig_host": "no.such.host.invalid"},
            "expected a host name or IPv4 address, found 'no.such.host.invalid'",
        ),
        (
            {"rate_hz": 10, "rig_timeout_s": 0.1},
            "rig_timeout_s: expected at least 1.5 periods of the 10 Hz of rate_hz",
        ),
        ({"end_with_parent": 1}, "end_with_parent: expected true or false, found 1"),
        ({"twin": ""}, "twin: expected the path of a twin file, found none"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(
    ros: Graph, values: dict, sentence: str
) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        ros.add(DriverNode, **{"twin": str(TWIN), **values}).start()


def test_a_rig_that_cannot_be_driven_and_a_port_that_is_taken_are_refused(
    ros: Graph, shared: DrivenEmulator, tmp_path
) -> None:
    pole = "schema: pendulum_twin/1\nname: p\nrig:\n  pole_mass_kg: 0.1\n  com_distance_m: 0.1\n"
    (tmp_path / "pole.yaml").write_text(
        pole + "  pole_inertia_kg_m2: 0.002\n  pole_viscous_n_m_s: 0.0\n"
    )
    with pytest.raises(BadInputError, match="rail guard: expected a rig with a cart"):
        make_driver(ros, shared, twin=str(tmp_path / "pole.yaml"))
    make_driver(ros, shared)
    with pytest.raises(
        BadInputError, match=r"cannot listen on 127\.0\.0\.1:\d+: Address already in use"
    ):
        make_driver(ros, shared)
