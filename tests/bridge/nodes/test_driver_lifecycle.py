"""The driver as a lifecycle node: PWM is 0 outside `active`, whatever happens."""

import itertools
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState, GetState
from rclpy.parameter import Parameter
from support.driven_rig import MODULE, RawRig, User, arguments_for
from support.ros_graph import DEADLINE_S, Graph, until
from support.running_emulator import TWIN

from pendulum_bridge.driver.driver import LAST_WORDS, Driver
from pendulum_bridge.nodes.driver_making import collect_rules
from pendulum_bridge.nodes.driver_node import UNCONFIGURED, DriverNode
from pendulum_bridge.safety.encoder_check import Encoders
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import Command, Sample
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin, save_twin

PATIENT = {"rig_timeout_s": 60.0, "command_timeout_s": 60.0}
WARN, ERROR = 1, 2


class Bench:
    """A driver that waits for its transitions, a bare socket as its rig, and a user."""

    def __init__(self, ros: Graph, **values: object) -> None:
        self.ros, self.rig, self.user = ros, RawRig(), User(ros)
        self.heard: list[float] = []
        self._wobble = itertools.cycle((0.0, 1e-4))
        given = {"twin": str(TWIN), "autostart": False, **PATIENT, **self.rig.ports, **values}
        self.node: DriverNode = ros.add(DriverNode, **given)
        self._change = self.user.node.create_client(ChangeState, "/driver/change_state")
        self._state = self.user.node.create_client(GetState, "/driver/get_state")

    def set(self, transition: int) -> bool:
        request = ChangeState.Request(transition=Transition(id=transition))
        return self.ros.call(self._change, request).success

    @property
    def state(self) -> str:
        return self.ros.call(self._state, GetState.Request()).current_state.label

    def step(self, pwm: float | None = None) -> None:
        """Send a sample, and perhaps a command; note what the rig hears."""
        offset = next(self._wobble)
        self.rig.send(Sample(3.14159 + offset, 0.0, offset, 0.0))
        if pwm is not None:
            self.user.send(pwm)
        self.ros.spin()
        self.heard += [command.pwm for command in self.rig.heard()]

    def drive(self, pwm: float) -> None:
        until(lambda: self.heard and self.heard[-1] == pwm, f"PWM {pwm}", lambda: self.step(pwm))

    def listen(self, steps: int) -> None:
        """Send so many samples, and note what the rig hears."""
        for _ in range(steps):
            self.step()

    def listen_while_commanding(self, pwm: float, what: str, sentence: str) -> None:
        """Command until the driver says a sentence; nothing but 0 is heard meanwhile."""
        self.heard += [command.pwm for command in self.rig.heard()]
        before = len(self.heard)
        self.user.healths.clear()
        until(
            lambda: [h for h in self.user.healths if sentence in h.message],
            what,
            lambda: self.step(pwm),
        )
        assert set(self.heard[before:]) <= {0.0}


@pytest.fixture
def bench(ros: Graph):
    made = Bench(ros)
    yield made
    made.rig.close()


def test_the_rig_hears_commands_only_while_the_driver_is_active(bench: Bench) -> None:
    assert bench.state == "unconfigured" and bench.node.driver is None
    bench.listen_while_commanding(0.2, "the state", UNCONFIGURED)
    assert not bench.heard, "an unconfigured driver has no link"
    assert bench.set(Transition.TRANSITION_CONFIGURE) and bench.state == "inactive"
    bench.listen_while_commanding(0.2, "the state", Reason.INACTIVE.sentence)
    assert bench.user.call("reset").message == Reason.RESET_INACTIVE.sentence
    assert bench.set(Transition.TRANSITION_ACTIVATE) and bench.state == "active"
    bench.drive(0.2)
    assert bench.set(Transition.TRANSITION_DEACTIVATE) and bench.state == "inactive"
    bench.listen_while_commanding(0.2, "the state", Reason.INACTIVE.sentence)
    assert bench.set(Transition.TRANSITION_ACTIVATE)
    bench.drive(0.1)
    assert bench.set(Transition.TRANSITION_DEACTIVATE)
    assert bench.set(Transition.TRANSITION_CLEANUP) and bench.state == "unconfigured"
    bench.listen_while_commanding(0.1, "the state", UNCONFIGURED)
    assert bench.heard[-LAST_WORDS:] == [0.0] * LAST_WORDS
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.set(Transition.TRANSITION_ACTIVATE)
    bench.drive(0.1)
    assert bench.set(Transition.TRANSITION_ACTIVE_SHUTDOWN) and bench.state == "finalized"
    bench.heard += [command.pwm for command in bench.rig.heard()]
    assert bench.heard[-LAST_WORDS:] == [0.0] * LAST_WORDS


@pytest.mark.parametrize("timeout_s", [0.05, 60.0])
def test_a_command_from_before_the_activation_is_not_taken(ros: Graph, timeout_s: float) -> None:
    """It waits in the node's queue while nobody spins the node."""
    bench = Bench(ros, command_timeout_s=timeout_s)
    bench.user.until(bench.user.sender.get_subscription_count, "discovery")
    bench.user.send(0.2)
    bench.node.start()
    bench.user.until(
        lambda: bench.node.driver.counts.after_standstill == 1,
        "the command",
    )
    bench.listen(20)
    assert bench.heard and set(bench.heard) == {0.0}
    bench.drive(0.1)
    bench.rig.close()


@pytest.mark.parametrize(
    "transition", [Transition.TRANSITION_ACTIVATE, Transition.TRANSITION_CLEANUP, 240]
)
def test_a_transition_that_the_state_does_not_allow_is_refused(bench, transition) -> None:
    assert not bench.set(transition) and bench.state == "unconfigured"


def test_a_health_that_fails_is_an_error_and_pwm_0_and_the_node_lives_on(
    bench: Bench, monkeypatch
) -> None:
    bench.node.start()
    bench.drive(0.2)
    monkeypatch.setattr(Driver, "health", lambda driver: 1 / 0)
    bench.user.healths.clear()
    failed = "The health of /driver could not be told: ZeroDivisionError"
    says = lambda: [h for h in bench.user.healths if failed in h.message]  # noqa: E731
    until(lambda: len(says()) > 1, "two reports", bench.step)
    assert {h.level for h in says()} == {bytes([ERROR])} and bench.heard[-1] == 0.0
    monkeypatch.undo()
    bench.drive(0.1)


def test_a_failed_transition_sends_0_and_latches(bench, monkeypatch) -> None:
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.set(Transition.TRANSITION_ACTIVATE)
    bench.drive(0.2)
    monkeypatch.setattr(Driver, "deactivate", lambda driver: 1 / 0)
    assert not bench.set(Transition.TRANSITION_DEACTIVATE)
    bench.heard += [command.pwm for command in bench.rig.heard()]
    assert bench.heard[-LAST_WORDS:] == [0.0] * LAST_WORDS and bench.state == "unconfigured"
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.set(Transition.TRANSITION_ACTIVATE) and bench.state == "active"
    bench.listen_while_commanding(0.2, "the latch", Reason.STOPPED.sentence)
    assert bench.user.stopped[-1]


def test_a_latched_stop_outlasts_every_transition(bench: Bench) -> None:
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.user.call("stop").success
    for transition in (
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    ):
        assert bench.set(transition)
    bench.listen_while_commanding(0.2, "the latch", Reason.STOPPED.sentence)


@pytest.mark.parametrize("begun", [False, True], ids=["never configured", "cleaned up"])
def test_without_a_driver_a_stop_is_cleared_by_0_alone_too(bench: Bench, begun: bool) -> None:
    """Else the commands that still come would move the cart at the next activation."""
    if begun:
        assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.user.call("stop").success
    if begun:
        assert bench.set(Transition.TRANSITION_CLEANUP)
    ros, commands = bench.ros, bench.user
    ros.until(commands.sender.get_subscription_count, "the driver")
    for _ in range(3):
        commands.send(0.2)
        assert commands.call("clear_stop").message == Reason.ZERO_FIRST.sentence
    assert bench.user.stopped[-1]
    ros.until(lambda: commands.send(0.0) or commands.call("clear_stop").success, "a cleared stop")
    ros.until(lambda: not commands.stopped[-1], "its message")
    assert commands.call("clear_stop").message == Reason.NOT_STOPPED.sentence


@pytest.mark.parametrize("later", ["gone", "of another rig"])
def test_a_limit_changes_on_the_twin_that_was_configured(
    ros: Graph, tmp_path: Path, later: str
) -> None:
    """Rail, signs and constants are those of the start, whatever becomes of the file."""
    file = tmp_path / "twin.yaml"
    twin = load_twin(TWIN)
    save_twin(twin, file)
    bench = Bench(ros, twin=str(file))
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    expected = collect_rules(replace(bench.node.settings, pwm_limit=0.1), twin)
    file.unlink()
    if later == "of another rig":
        longer = replace(twin.rig, rail_half_length_m=2.0)
        save_twin(replace(twin, rig=longer, effects={"input_sign_inverted": {}}), file)
    assert bench.node.set_parameters([Parameter("pwm_limit", value=0.1)])[0].successful
    assert bench.node.driver._rules == expected
    bench.rig.close()


def test_an_encoder_fault_that_lasts_needs_a_person_after_every_transition(bench: Bench) -> None:
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.set(Transition.TRANSITION_ACTIVATE)
    bench.drive(0.2)
    driver = bench.node.driver
    with driver._lock:
        driver._safety = replace(driver._safety, encoders=Encoders(Reason.ENCODER_JUMPED))
    bench.listen_while_commanding(0.2, "the jump", Reason.ENCODER_JUMPED.sentence)
    for transition in (
        Transition.TRANSITION_DEACTIVATE,
        Transition.TRANSITION_CLEANUP,
        Transition.TRANSITION_CONFIGURE,
        Transition.TRANSITION_ACTIVATE,
    ):
        assert bench.set(transition)
    bench.listen_while_commanding(0.2, "the latch", Reason.STOPPED.sentence)
    assert bench.user.stopped[-1]
    until(
        lambda: not bench.node.driver.stopped,
        "a command of 0, and the stop to be cleared",
        lambda: bench.step(0.0) or bench.user.call("clear_stop"),
    )
    bench.drive(0.2)


def test_a_release_whose_pwm_0_the_network_refuses_is_an_error(bench: Bench, monkeypatch) -> None:
    assert bench.set(Transition.TRANSITION_CONFIGURE)
    assert bench.set(Transition.TRANSITION_ACTIVATE)
    bench.drive(0.2)

    def refuse(link: Link, command: Command) -> None:
        raise BadInputError("cannot send to the rig: Network is unreachable")

    monkeypatch.setattr(Link, "send", refuse)
    bench.node.finish()
    assert "(cannot send to the rig: Network is unreachable)" in bench.node.left
    assert bench.node.left.endswith("the rig may hold PWM 0.2: switch it off")
    until(  # the companion is not refused
        lambda: bench.heard[-LAST_WORDS:] == [0.0] * LAST_WORDS, "PWM 0", lambda: bench.step(0.2)
    )


def test_what_cannot_be_configured_stays_unconfigured(ros: Graph) -> None:
    bench = Bench(ros, twin="/no/such.yaml")
    assert not bench.set(Transition.TRANSITION_CONFIGURE) and bench.state == "unconfigured"
    bench.rig.close()


def test_the_program_activates_itself_and_says_its_limits(ros: Graph) -> None:
    rig, user = RawRig(), User(ros)
    driver = ros.start(MODULE, *arguments_for(rig, pwm_limit=0.1))
    said = driver.stderr.readline()
    assert "limits: PWM 0.1, slew 50 /s, PWM 0 after 0.2 s without a command" in said
    assert "active: commands are accepted" in driver.stderr.readline()
    driver.terminate()
    assert driver.wait(timeout=DEADLINE_S) == 0
    rig.close()
    assert user.stopped is not None


def test_a_misspelt_limit_does_not_reach_the_rig(ros: Graph) -> None:
    rig = RawRig()
    driver = ros.start(MODULE, *arguments_for(rig, pwm_limt=0.1))
    said, complaints = driver.communicate(timeout=DEADLINE_S)
    assert (driver.returncode, said) == (1, "") and not rig.heard()
    assert complaints == (
        "driver_node: pwm_limt: expected a parameter of /driver, found none of this name; "
        "the nearest name is pwm_limit\n"
    )
    rig.close()
