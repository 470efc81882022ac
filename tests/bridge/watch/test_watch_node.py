"""The watch on the ROS graph: a twin in the rig's place changes, and /diagnostics says where."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
import yaml

rclpy = pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.lockstep_user import LockstepUser  # noqa: E402
from support.paths import ROOT  # noqa: E402
from support.ros_graph import Graph, until  # noqa: E402
from support.served_twin import served, served_twin  # noqa: E402
from support.watched_rigs import make_rig, make_twin  # noqa: E402

from pendulum_bridge.nodes.watch_node import WatchNode  # noqa: E402
from pendulum_bridge.nodes.watch_settings import WatchSettings  # noqa: E402
from pendulum_bridge.watch.watch import Phase  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402
from pendulum_twin.model import Twin, save_twin  # noqa: E402
from pendulum_twin.nodes.running import spin  # noqa: E402
from pendulum_twin.plans.excitation import compute_command, make_standard_plan  # noqa: E402

TRUTH = make_rig(11)
FORCE_N = TRUTH.rig.force_per_pwm_n


@contextmanager
def watching(ros: Graph, **values: object) -> Iterator[WatchNode]:
    """Run a watch in a thread of its own."""
    parameters = [Parameter(name, value=value) for name, value in values.items()]
    with served(WatchNode(context=ros.context, parameter_overrides=parameters), spin) as node:
        yield node


class Driver:
    """Drive a twin in lockstep with the standard plan, a second or more at a time."""

    def __init__(self, user: LockstepUser) -> None:
        self._user, self._plan, self._k = user, make_standard_plan(seconds=60.0, seed=3), 0
        self.stamp_ns, self._state = user.begin()

    def drive(self, seconds: float) -> None:
        for _ in range(round(seconds * 100)):
            command = compute_command(
                self._plan, self._k % 6000, float(self._state[0]), float(self._state[2]), 1
            )
            self.stamp_ns, self._state = self._user.step(command)
            self._k += 1


@pytest.fixture
def files(tmp_path: Path) -> dict[str, Path]:
    """Return twin files: the rig, the rig with a weaker drive, and the twin of a diagnosis."""
    weaker = replace(TRUTH.rig, force_per_pwm_n=0.8 * FORCE_N)
    twins = {
        "rig": Twin("rig", TRUTH.rig, TRUTH.effects),
        "weaker": Twin("weaker", weaker, TRUTH.effects),
        "twin": make_twin(TRUTH, 11),
    }
    for name, twin in twins.items():
        save_twin(twin, tmp_path / f"{name}.yaml")
    return {name: tmp_path / f"{name}.yaml" for name in twins}


def told(heard: list[DiagnosticStatus]) -> str:
    return heard[-1].message if heard else ""


def test_a_drive_that_loses_force_is_named_on_diagnostics(
    ros: Graph, files: dict[str, Path]
) -> None:
    heard: list[DiagnosticStatus] = []
    user = LockstepUser(ros)

    def listen(message: DiagnosticArray) -> None:
        heard.extend(status for status in message.status if status.name == "/watch")

    user.node.create_subscription(DiagnosticArray, "/diagnostics", listen, 10)
    with (
        served_twin(ros, lockstep=True, twin=str(files["rig"])),
        watching(ros, twin=str(files["twin"]), rig="/", simulated=True, learn_s=8.0) as node,
    ):
        topics = ("joint_states", "applied_pwm")
        ros.until(lambda: all(node.count_publishers(f"/{topic}") for topic in topics), "discovery")
        driver = Driver(user)
        driver.drive(15.0)
        ros.until(lambda: told(heard) == "/ moves as its twin says", "the end of learning")
        assert heard[-1].level == DiagnosticStatus.OK
        assert user.set_twin(files["weaker"]).successful
        driver.drive(14.0)
        ros.until(lambda: "changed" in told(heard), "the alarm")
        alarm, values = heard[-1], {pair.key: pair.value for pair in heard[-1].values}
        assert alarm.level == DiagnosticStatus.ERROR and alarm.message.startswith(
            "/ has changed: drive: "
        )
        assert (values["place"], values["effect"], values["unit"]) == (
            "drive",
            "force_per_pwm_n",
            "N",
        )
        assert float(values["size"]) == pytest.approx(-0.2 * FORCE_N, rel=0.15)
        assert 15.0 < float(values["raised"]) < 29.0 and float(values["confidence"]) > 0.9
        assert values["lost_samples"] == "0"
        ros.until(
            lambda: node._watch.stream.stamp_ns >= driver.stamp_ns - 10**7, "the last sample"
        )
        cleared = ros.call(user.node.create_client(Trigger, "watch/clear_alarm"))
        assert cleared.success and cleared.message.startswith("cleared: drive: ")
        assert node._watch.alarm is None  # a slow machine says 'no samples' on diagnostics by now
        learns = ros.call(user.node.create_client(Trigger, "watch/learn"))
        assert learns.success and learns.message == "learns from 8 s of motion"
        assert (node._watch.phase, node._watch.learned_s) == (Phase.LEARNING, 0.0)


def test_messages_that_are_no_samples_do_no_harm(ros: Graph, files: dict[str, Path]) -> None:
    node = ros.add(WatchNode, twin=str(files["twin"]))
    for message in (
        JointState(name=["wheel"]),
        JointState(name=["cart", "pole"], position=[0.0, np.nan], velocity=[0.0, 0.0]),
    ):
        node.on_sample(message, {"source_timestamp": 0})
    assert node.health().sentence == "/rig: no samples yet"


def test_another_twin_file_is_taken_while_it_runs(ros: Graph, files: dict[str, Path]) -> None:
    node = ros.add(WatchNode, twin=str(files["twin"]))
    answers = [
        node.set_parameters([Parameter("twin", value=str(path))])[0]
        for path in (files["rig"], "nowhere.yaml")
    ]
    assert answers[0].successful and node._settings.twin == str(files["rig"])
    assert not answers[1].successful and "nowhere.yaml: expected a twin file" in answers[1].reason
    heard: list[str] = []
    ros.user().create_subscription(
        DiagnosticArray, "/diagnostics", lambda m: heard.append(m.status[0].hardware_id), 10
    )
    ros.until(lambda: heard, "the diagnostics")
    assert heard[0] == "rig"


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({}, "twin: expected the path of a twin file, found none"),
        ({"twin": "nowhere.yaml"}, "nowhere.yaml: expected a twin file, but it cannot be read"),
        (
            {"twin": "t", "rig": "no namespace"},
            "rig: expected a namespace such as /rig, found 'no namespace'",
        ),
        (
            {"twin": "t", "rate_hz": float("nan")},
            "rate_hz: expected a number from 20 to 1000, found nan",
        ),
        ({"twin": "t", "learn_s": 1}, "learn_s: expected a number from 5 to 3600, found 1"),
        ({"twin": "t", "simulated": "yes"}, "simulated: expected true or false, found 'yes'"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(
    ros: Graph, values: dict[str, object], sentence: str
) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        ros.add(WatchNode, **values)


def test_the_parameter_file_holds_the_defaults() -> None:
    values = yaml.safe_load((ROOT / "config" / "ros" / "watch.yaml").read_text(encoding="utf-8"))[
        "/**"
    ]["ros__parameters"]
    defaults = {each.name: each.default for each in fields(WatchSettings)}
    assert values == {
        name: value for name, value in defaults.items() if name not in ("twin", "rig", "rate_hz")
    }


def test_the_program_says_what_is_wrong_and_ends(ros: Graph) -> None:
    program = ros.start(
        "pendulum_bridge.nodes.watch_node", "--ros-args", "-p", "twin:=nowhere.yaml"
    )
    _, said = program.communicate(timeout=60)
    assert program.returncode == 1 and said.startswith(
        "watch_node: nowhere.yaml: expected a twin file"
    )


def test_the_program_ends_cleanly(ros: Graph, files: dict[str, Path]) -> None:
    program = ros.start(
        "pendulum_bridge.nodes.watch_node", "--ros-args", "-p", f"twin:={files['twin']}"
    )
    assert "watches /rig with the twin improved" in until(
        program.stderr.readline, "its first words", lambda: None
    )
    program.terminate()
    assert program.wait(timeout=60) == 0
