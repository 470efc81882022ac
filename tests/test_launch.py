"""The launch files: what they declare and start is there, and what they start works together."""

import itertools
import math
import os
import runpy
import shutil
import signal
import subprocess
import sys
import xml.etree.ElementTree as ET
from dataclasses import fields
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
import yaml

pytest.importorskip("rclpy")
from sensor_msgs.msg import JointState
from support.launch_files import LAUNCH, SRC, Launch, Process, expanded, read
from support.launch_running import OURS, executables, running
from support.paths import ROOT
from support.ros_graph import Graph, until
from support.running_emulator import free_ports

from pendulum_sysid.reading.bag import read_bag

TWIN = ROOT / "config" / "inteco.yaml"
FILES = sorted(path.name.removesuffix(".launch.xml") for path in LAUNCH.glob("*.xml"))
GIVEN = {
    "twin": "twin.yaml",
    "out": "bag",
    "namespace": "rig",
}  # what has no default, besides choices
PLAN = {
    "schema": "pendulum_plan/1",
    "phases": [
        {"kind": "push"},
        {"kind": "chirp", "seconds": 1.5, "from_hz": 1.0, "to_hz": 2.0, "amplitude": 0.2},
    ],
}
LONG_S = 180.0
# A machine that stands still for a second must not look like a rig that is silent.
PATIENT = {
    "driver": {"rig_timeout_s": 5.0, "command_timeout_s": 5.0, "reset_deadline_s": 60.0},
    "excitation": {
        "silence_s": 5.0,
        "overruled_s": 5.0,
        "ready_timeout_s": LONG_S,
        "reset_timeout_s": 60.0,
    },
    "view": {"port": 0},
}


def find_settings(executable: str, package: str) -> type:
    """Return the dataclass of a node's parameters."""
    module = executables(package)[executable].split(":")[0]
    found = vars(import_module(f"{module.removesuffix('_node')}_settings"))
    return next(
        each
        for name, each in found.items()
        if name.endswith("Settings") and each.__module__.endswith("_settings")
    )


def list_declared(name: str) -> dict[str, ET.Element]:
    return {
        each.attrib["name"]: each
        for each in ET.parse(LAUNCH / f"{name}.launch.xml").getroot().iterfind("arg")
    }


def ways() -> list[tuple[str, dict[str, str]]]:
    """Return each launch file with each combination of what its choices and switches may be."""
    found = []
    for name in FILES:
        arguments = list_declared(name)
        given = {key: value for key, value in GIVEN.items() if key in arguments}
        free = {
            key: [c.attrib["value"] for c in each] for key, each in arguments.items() if len(each)
        }
        free |= {
            key: ["true", "false"]
            for key, each in arguments.items()
            if each.get("default") == "false"
        }
        free |= {"conceal": ["none", "5"]} if "conceal" in arguments else {}
        for values in itertools.product(*free.values()):
            found.append((name, given | dict(zip(free, values, strict=True))))
    return found


WAYS = ways()
PROCESSES = [process for name, given in WAYS for process in read(name, **given).processes]
NODES = [process for process in PROCESSES if process.is_node and process.package in OURS]


def only(launch: Launch, executable: str) -> Process:
    (found,) = launch.of(executable)
    return found


def given_to(process: Process) -> dict[str, object]:
    """Return the parameters that the launch file itself sets on a node."""
    return {
        key: value
        for each in process.parameters
        if isinstance(each, dict)
        for key, value in each.items()
    }


def test_the_files_are_there() -> None:
    assert FILES == ["identify", "model", "pendulum", "rig", "twin"]
    assert len(WAYS) > 50 and len(NODES) > 100


@pytest.mark.parametrize("name", FILES)
def test_every_argument_is_described_and_the_twin_has_no_default(name: str) -> None:
    for argument in read(
        name, **next(given for file, given in WAYS if file == name)
    ).arguments.values():
        assert len(argument.description) > 15, argument
        vital = argument.name in ("twin", "out") or (name, argument.name) in {
            ("pendulum", "pendulum"),
            ("model", "namespace"),
        }
        assert (argument.default is None) == vital, argument


@pytest.mark.parametrize("name", FILES)
def test_no_twin_file_is_an_error(name: str) -> None:
    given = {
        key: value
        for key, value in next(given for file, given in WAYS if file == name).items()
        if key != "twin"
    }
    with pytest.raises(AssertionError, match="argument twin was not given"):
        read(name, **given)


def test_executables_are_there() -> None:
    needed = {
        each.text
        for each in ET.parse(SRC / "pendulum_bridge" / "package.xml").getroot().iter("exec_depend")
    }
    for process in PROCESSES:
        if process.package in OURS:
            assert process.executable in executables(process.package)
            assert import_module(
                executables(process.package)[process.executable].split(":")[0]
            ).main
        else:
            assert process.package in needed, f"{process.package} is not in package.xml"


def test_parameters_are_the_nodes_own_and_files_do_not_repeat_them() -> None:
    for process in NODES:
        known = {each.name for each in fields(find_settings(process.executable, process.package))}
        (file,) = (each for each in process.parameters if isinstance(each, Path))
        filed = yaml.safe_load(file.read_text(encoding="utf-8"))["/**"]["ros__parameters"]
        assert set(filed) | set(given_to(process)) == known, process.executable
        assert set(filed).isdisjoint(given_to(process)), (
            process.executable
        )  # the file's would never count


def test_nodes_take_what_they_are_given() -> None:
    for process in NODES:
        filed = yaml.safe_load(process.parameters[0].read_text(encoding="utf-8"))["/**"][
            "ros__parameters"
        ]  # type: ignore[union-attr]
        find_settings(process.executable, process.package)(**filed, **given_to(process))


@pytest.mark.parametrize("kind", ["rig", "emulated", "twin"])
def test_one_argument_puts_rig_or_twin_in_the_same_place(kind: str) -> None:
    launch = read("pendulum", twin="t.yaml", pendulum=kind)
    main = only(launch, "twin_node" if kind == "twin" else "driver_node")
    assert (main.namespace, main.ends_all, given_to(main)["twin"]) == ("/rig", True, "t.yaml")
    assert len(launch.of("rig_emulator")) == (kind == "emulated")


def test_arguments_reach_the_emulated_rig_and_the_driver_alike() -> None:
    given = {"rig_port": 7, "listen_port": 8, "rate_hz": 50, "conceal": 13, "seal": "s.json"}
    launch = read("identify", twin="a twin.yaml", out="o", pendulum="emulated", **given)
    arguments = " ".join(only(launch, "rig_emulator").arguments)
    assert (
        "--twin a twin.yaml" in arguments
        and "a twin.yaml" in only(launch, "rig_emulator").arguments
    )
    assert (
        "--listen 127.0.0.1:7 --send 127.0.0.1:8 --conceal 13 --seal s.json" in arguments
        and "--rate 50" in arguments
    )
    driver = given_to(only(launch, "driver_node"))
    assert (driver["rig_port"], driver["listen_port"], driver["rate_hz"]) == (7, 8, 50.0)
    assert given_to(only(launch, "twin_node"))["rate_hz"] == 50.0


def test_the_watch_is_asked_for_and_holds_the_rig_against_the_twin_file() -> None:
    assert not read("rig", twin="t.yaml").of("watch_node")
    watch = only(
        read("rig", twin="t.yaml", namespace="lab", watch="true", rate_hz=50), "watch_node"
    )
    assert (
        given_to(watch) == {"twin": "t.yaml", "rig": "/lab", "rate_hz": 50.0}
        and not watch.ends_all
    )
    assert read("pendulum", twin="t.yaml", pendulum="emulated", watch="true").of("watch_node")


@pytest.mark.parametrize(("view", "listeners"), [("true", 3), ("false", 2)])
def test_identify_waits_for_all_that_listen_and_ends_with_its_parts(
    view: str, listeners: int
) -> None:
    launch = read("identify", twin="t.yaml", out="o", view=view)
    assert given_to(only(launch, "excitation_node"))["listeners"] == listeners
    vital = {process.executable for process in launch.processes if process.ends_all}
    assert vital == {"driver_node", "twin_node", "recorder_node", "excitation_node"}
    assert len(launch.of("view_node")) == (view == "true")


def test_the_standard_plan_has_the_rate_of_rig_and_twin() -> None:
    launch = read("identify", twin="t.yaml", out="o", rate_hz=50)
    for node in ("driver_node", "twin_node", "excitation_node"):
        assert given_to(only(launch, node))["rate_hz"] == 50.0


def test_a_program_that_fails_fails_the_launch_of_an_experiment(monkeypatch) -> None:
    assert read("identify", **GIVEN, pendulum="emulated").fails_with_parts
    for name in ("launch", "launch.actions", "launch.event_handlers"):
        monkeypatch.setitem(sys.modules, name, MagicMock())
    report = runpy.run_path(str(LAUNCH / "end_with_failure.launch.py"))["report_failure"]
    ended = SimpleNamespace(process_name="excitation_node-5", returncode=1)
    with pytest.raises(RuntimeError, match="excitation_node-5 ended with status 1"):
        report(ended, SimpleNamespace(is_shutdown=False))
    report(ended, SimpleNamespace(is_shutdown=True))
    report(SimpleNamespace(process_name="any", returncode=0), SimpleNamespace(is_shutdown=False))


def test_models_stand_side_by_side_and_come_from_the_twin_file() -> None:
    launch = read("identify", twin="a twin.yaml", out="o", rviz="true")
    frames = {
        process.namespace: process.arguments for process in launch.of("static_transform_publisher")
    }
    assert frames["/rig"] == (
        "--y",
        "0.0",
        "--frame-id",
        "world",
        "--child-frame-id",
        "rig/rail_link",
    )
    assert frames["/twin"] == (
        "--y",
        "0.4",
        "--frame-id",
        "world",
        "--child-frame-id",
        "twin/rail_link",
    )
    for model in launch.of("robot_state_publisher"):
        description = 'output of lib/pendulum_twin/twin_urdf "a twin.yaml"'
        assert given_to(model) == {
            "robot_description": description,
            "frame_prefix": f"{model.namespace[1:]}/",
        }
    assert len(launch.of("rviz2")) == 1 and Path(only(launch, "rviz2").arguments[1]).is_file()


def patient(folder: Path) -> dict[str, Path]:
    """Write copies of the parameter files that suit a test, and return their arguments."""
    for name, values in PATIENT.items():
        mapping = yaml.safe_load(
            (SRC / "pendulum_bridge" / "config" / f"{name}.yaml").read_text(encoding="utf-8")
        )
        mapping["/**"]["ros__parameters"] |= values
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(mapping), encoding="utf-8")
    return {f"{name}_params": folder / f"{name}.yaml" for name in PATIENT}


class Samples:
    """What is published in a namespace."""

    def __init__(self, ros: Graph, namespace: str) -> None:
        self.got: list[JointState] = []
        ros.user(f"hears_{namespace}").create_subscription(
            JointState, f"/{namespace}/joint_states", self.got.append, 100
        )


def test_an_emulated_rig_runs_and_ends_well(ros: Graph, tmp_path: Path) -> None:
    rig, user = free_ports()
    samples = Samples(ros, "rig")
    launch = read(
        "rig",
        twin=TWIN,
        emulated="true",
        watch="true",
        rig_port=rig,
        listen_port=user,
        **patient(tmp_path),
    )
    with running(launch, ros.environment, tmp_path / "programs") as programs:
        ros.until(lambda: len(samples.got) > 20 or programs.over(), "samples of the rig", LONG_S)
        assert programs.over() == ""
        assert list(samples.got[-1].name) == ["cart", "pole"]
        assert samples.got[-1].position == pytest.approx([0.0, math.pi], abs=0.01)
        ros.until(lambda: "watches /rig" in programs.said(), "the watch", LONG_S)
        assert programs.end() == {"rig_emulator": 0, "driver_node": 0, "watch_node": 0}, (
            programs.said()
        )


def test_identify_records_a_plan_and_ends_by_itself(ros: Graph, tmp_path: Path) -> None:
    rig, user = free_ports()
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(PLAN), encoding="utf-8")
    heard = {name: Samples(ros, name) for name in ("rig", "twin")}
    launch = read(
        "identify", twin=TWIN, out=tmp_path / "bag", plan=tmp_path / "plan.yaml",
        pendulum="emulated",
        rig_port=rig, listen_port=user, view="true", **patient(tmp_path),
    )  # fmt: skip
    with running(launch, ros.environment, tmp_path / "programs") as programs:
        ros.until(programs.over, "the end of the plan", 2 * LONG_S)
        assert programs.over() == "excitation_node"
        assert set(programs.end().values()) == {0}, programs.said()
    assert all(len(each.got) > 100 for each in heard.values())
    for name in heard:
        recorded = read_bag(tmp_path / "bag", f"/{name}/joint_states", f"/{name}/pwm")
        assert recorded.given_up == "", "the plan ended, and the recording knows it"
        assert (
            len(recorded.command) >= 200 and recorded.cut_short is False
        )  # of 3 s, and what comes before
        assert max(abs(recorded.command)) > 0.2 and max(abs(recorded.cart)) > 0.02


@pytest.mark.skipif(
    shutil.which("ros2") is None,
    reason="there is no ros2 command; the same is tested without it above",
)
def test_ros2_launch_does_the_same(ros: Graph, tmp_path: Path) -> None:
    rig, user = free_ports()
    colcon = [
        Path(sys.executable).parent / "colcon",
        f"--log-base={tmp_path / 'log'}",
        "build",
        "--base-paths",
        SRC,
    ]
    subprocess.run(
        [*colcon, f"--build-base={tmp_path / 'build'}", f"--install-base={tmp_path / 'i'}"],
        check=True,
        timeout=900,
    )
    (tmp_path / "plan.yaml").write_text(yaml.safe_dump(PLAN), encoding="utf-8")
    given = {
        "twin": TWIN,
        "out": tmp_path / "bag",
        "plan": tmp_path / "plan.yaml",
        "pendulum": "emulated",
    }
    given |= {"rig_port": rig, "listen_port": user, **patient(tmp_path)}
    theta = " ".join(f"{key}:={value}" for key, value in given.items())
    line = (
        f". {tmp_path / 'i' / 'setup.sh'} && exec ros2 launch pendulum_bridge identify.launch.xml "
        f"{theta}"
    )
    launched = subprocess.Popen(["sh", "-c", line], env=ros.environment, start_new_session=True)
    try:
        until(lambda: launched.poll() is not None, "the end of the plan", ros.spin, 3 * LONG_S)
    finally:
        if launched.poll() is None:
            os.killpg(launched.pid, signal.SIGKILL)
            launched.wait()
    assert launched.returncode == 0
    assert len(read_bag(tmp_path / "bag").command) >= 200


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("a $(var x)/$(var y)", "a 1 2/3"),
        ("$(equals $(var y) 3) $(equals $(var x) '1 2') $(not $(equals a b))", "true true true"),
        ("$(command '$(exec-in-pkg e p) \"$(var x)\"')", 'output of lib/p/e "1 2"'),
    ],
)
def test_the_reader_carries_substitutions_out(text: str, value: str) -> None:
    assert expanded(text, {"x": "1 2", "y": "3"}) == value


@pytest.mark.parametrize("text", ["$(vra x)", "$(var z)", "$(var x", "$(equals a)"])
def test_the_reader_refuses_what_launch_would(text: str) -> None:
    with pytest.raises(AssertionError):
        expanded(text, {"x": "1"})
