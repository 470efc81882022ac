"""The RViz file and the Foxglove layout name topics, services, fields and frames that exist."""

import json
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import Any

import pytest
import yaml
from support.launch_files import read
from support.paths import SRC

from pendulum_twin import topics

BRIDGE = SRC / "pendulum_bridge"
RVIZ = yaml.safe_load((BRIDGE / "rviz" / "pendulum.rviz").read_text(encoding="utf-8"))[
    "Visualization Manager"
]
LAYOUT = json.loads((BRIDGE / "foxglove" / "pendulum.json").read_text(encoding="utf-8"))
PANELS: dict[str, dict[str, Any]] = LAYOUT["configById"]
TYPES = {
    topics.JOINT_STATES: "JointState",
    topics.PWM: "Float64",
    topics.APPLIED_PWM: "Float64",
    topics.STOPPED: "Bool",
}
PATH = re.compile(r"/(rig|twin)/(\w+)\.(\w+)(?:\[[01]\])?")
SERVICE = re.compile(r"/(rig|twin)/(\w+)")


def placed(layout: Any) -> Iterator[str]:
    """Yield the panels of a layout: a tree of halves."""
    if isinstance(layout, str):
        yield layout
        return
    assert layout["direction"] in ("row", "column") and 0 < layout["splitPercentage"] < 100
    yield from placed(layout["first"])
    yield from placed(layout["second"])


def paths() -> list[str]:
    return [entry["value"] for panel in PANELS.values() for entry in panel.get("paths", [])]


def test_rviz_shows_rig_and_twin_in_the_frames_that_launch_files_make() -> None:
    models = [entry for entry in RVIZ["Displays"] if entry["Class"].endswith("/RobotModel")]
    assert len(models) == 2
    launch = read("identify", twin="t.yaml", out="o", rviz="true")
    frames = {
        process.arguments[-1]: process.arguments[3]
        for process in launch.of("static_transform_publisher")
    }
    prefixes = {
        process.parameters[1]["frame_prefix"] for process in launch.of("robot_state_publisher")
    }  # type: ignore[index]
    for model in models:
        prefix = model["TF Prefix"]
        assert model["Description Topic"]["Value"] == f"/{prefix}/robot_description"
        assert (
            model["Description Topic"]["Durability Policy"] == "Transient Local"
        )  # it is published once
        assert (
            f"{prefix}/" in prefixes
            and frames[f"{prefix}/rail_link"] == RVIZ["Global Options"]["Fixed Frame"]
        )


def test_rviz_asks_only_for_plugins_that_are_installed() -> None:
    needed = {
        entry.text for entry in ET.parse(BRIDGE / "package.xml").getroot().iter("exec_depend")
    }
    classes = {
        entry["Class"].split("/")[0]
        for entry in [*RVIZ["Displays"], *RVIZ["Tools"], RVIZ["Views"]["Current"]]
    }
    assert classes == {"rviz_default_plugins"} and classes <= needed


def test_every_panel_has_its_place() -> None:
    assert sorted(placed(LAYOUT["layout"])) == sorted(PANELS)


def test_plots_are_of_topics_and_fields_that_exist() -> None:
    sensor_msgs, std_msgs = (
        pytest.importorskip("sensor_msgs.msg"),
        pytest.importorskip("std_msgs.msg"),
    )
    for path in paths():
        found = PATH.fullmatch(path)
        assert found and found[2] in TYPES, path
        message = getattr(
            sensor_msgs if TYPES[found[2]] == "JointState" else std_msgs, TYPES[found[2]]
        )
        assert found[3] in message.get_fields_and_field_types(), path


def test_rig_and_twin_are_plotted_alike() -> None:
    found = paths()
    for field in ("position[0]", "position[1]", "velocity[0]"):
        assert {f"/{space}/{topics.JOINT_STATES}.{field}" for space in ("rig", "twin")} <= set(
            found
        )
    assert {
        f"/rig/{topics.PWM}.data",
        f"/rig/{topics.APPLIED_PWM}.data",
        f"/twin/{topics.APPLIED_PWM}.data",
    } <= set(found)


def test_buttons_call_services_that_exist_and_diagnostics_are_shown() -> None:
    services = [
        SERVICE.fullmatch(panel["serviceName"])
        for panel in PANELS.values()
        if "serviceName" in panel
    ]
    assert {found[2] for found in services if found} == {
        topics.STOP,
        topics.CLEAR_STOP,
        topics.RESET,
    }
    assert all(
        json.loads(panel["requestPayload"]) == {}
        for panel in PANELS.values()
        if "requestPayload" in panel
    )
    assert [panel["topicToRender"] for panel in PANELS.values() if "topicToRender" in panel] == [
        topics.DIAGNOSTICS
    ]
