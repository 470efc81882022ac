"""The ROS parameter files: rclpy reads them, nodes accept them, comments explain them."""

import re
from collections.abc import Iterator
from dataclasses import Field, fields
from typing import Any

import pytest
import yaml

pytest.importorskip("rclpy")
from rclpy.node import Node
from support.paths import CONFIG
from support.ros_graph import Graph

from pendulum_bridge.nodes.driver_settings import DriverSettings
from pendulum_bridge.nodes.excitation_settings import ExcitationSettings
from pendulum_bridge.nodes.recorder_settings import RecorderSettings
from pendulum_bridge.nodes.view_settings import ViewSettings
from pendulum_bridge.nodes.watch_settings import WatchSettings
from pendulum_twin.nodes.settings import declare_settings
from pendulum_twin.nodes.twin_settings import TwinSettings

FOLDER = CONFIG / "ros"
KINDS: dict[str, type] = {
    "driver": DriverSettings,
    "excitation": ExcitationSettings,
    "recorder": RecorderSettings,
    "twin": TwinSettings,
    "view": ViewSettings,
    "watch": WatchSettings,
}
# What has no default.
NEEDED = {
    "driver": "twin",
    "excitation": "twin_file",
    "recorder": "out",
    "twin": "twin",
    "watch": "twin",
}
VALUE = re.compile(r" {4}(\w+): (.*?)(?:  +# (.*))?$")


def read_values(name: str) -> dict[str, Any]:
    mapping = yaml.safe_load((FOLDER / f"{name}.yaml").read_text(encoding="utf-8"))
    assert list(mapping) == ["/**"] and list(mapping["/**"]) == ["ros__parameters"]
    return mapping["/**"]["ros__parameters"]


def read_comments(name: str) -> Iterator[tuple[str, str]]:
    """Yield each parameter with the comment beside it, or above it."""
    above = ""
    for line in (FOLDER / f"{name}.yaml").read_text(encoding="utf-8").splitlines():
        if match := VALUE.fullmatch(line):
            yield match[1], match[3] or above
        above = line.strip().removeprefix("# ") if line.startswith("    #") else ""


def test_there_is_a_file_for_each_node() -> None:
    assert sorted(path.name for path in FOLDER.iterdir()) == sorted(
        f"{name}.yaml" for name in KINDS
    )


@pytest.mark.parametrize("name", KINDS)
def test_rclpy_reads_it_and_the_node_takes_it(name: str, ros: Graph) -> None:
    kind, arguments = KINDS[name], ["--ros-args", "--params-file", str(FOLDER / f"{name}.yaml")]
    arguments += ["-p", f"{NEEDED[name]}:=somewhere"] if name in NEEDED else []
    node = ros.serve(Node(name, context=ros.context, cli_args=arguments))
    settings = declare_settings(node, kind)
    for key, value in read_values(name).items():
        setting = getattr(settings, key)
        assert (list(setting) if isinstance(setting, tuple) else setting) == value, key


@pytest.mark.parametrize("name", KINDS)
def test_it_holds_the_defaults_with_meaning_and_range(name: str) -> None:
    known: dict[str, Field[Any]] = {field.name: field for field in fields(KINDS[name])}
    comments = dict(read_comments(name))
    assert set(comments) == set(read_values(name)) <= set(known)
    for key, value in read_values(name).items():
        default, span = known[key].default, known[key].metadata["span"]
        assert value == (list(default) if isinstance(default, tuple) else default), (
            f"{key}: default {default}"
        )
        assert type(value) is type(default) or isinstance(value, list), key
        assert known[key].metadata["text"] in comments[key], key
        assert span is None or f"{span[0]:g} to {span[1]:g}" in comments[key], key


def test_an_example_with_a_rig_elsewhere_takes_samples_beyond_loopback() -> None:
    elsewhere = [example for example in DriverSettings.EXAMPLES if "rig_host:=" in example]
    assert elsewhere
    assert all("listen_host:=" in example for example in elsewhere)
