"""The command lines with which the page records and diagnoses: the workspace's own programs."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

from rclpy.node import Node

from pendulum_bridge.nodes.view_settings import ViewSettings
from pendulum_bridge.view.recordings import Programs
from pendulum_twin import topics

RECORDER, SYSID = "pendulum_bridge.nodes.recorder_node", "pendulum_sysid.cli"
READY = "recording to "  # what the recorder logs once it records
RECORDED = (topics.JOINT_STATES, topics.PWM, topics.APPLIED_PWM)


def make_programs(node: Node, settings: ViewSettings) -> Programs:
    """Return the programs that record what the page shows and diagnose the rig.

    Where the page shows no rig, the twin is taken for it. There is no diagnosis without a twin
    file or where `sysid` is not installed.
    """
    spaces = [space.rstrip("/") for space in (settings.rig, settings.twin) if space]
    heard = [f"{space}/{name}" for space in spaces for name in RECORDED] + [topics.DIAGNOSTICS]
    parameters = {
        "topics": heard,
        "twin": settings.twin_file,
        "note": "recorded from the live page",
        "end_with_parent": True,
        "use_sim_time": bool(node.get_parameter("use_sim_time").value),
    }
    if settings.excitation:
        parameters["outcome"] = f"{settings.excitation.rstrip('/')}/{topics.OUTCOME}"

    def record(folder: Path) -> Sequence[str]:
        command = [sys.executable, "-m", RECORDER, "--ros-args"]
        command += ["-r", f"__ns:={node.get_fully_qualified_name()}"]
        for name, value in {"out": str(folder), **parameters}.items():
            command += ["-p", f"{name}:={json.dumps(value)}"]  # JSON is YAML, too
        return command

    def diagnose(recording: Path, out: Path) -> Sequence[str]:
        command = [sys.executable, "-m", SYSID, "diagnose", str(recording)]
        command += ["--state-topic", f"{spaces[0]}/{topics.JOINT_STATES}"]
        command += ["--command-topic", f"{spaces[0]}/{topics.APPLIED_PWM}"]
        return [*command, "--twin", settings.twin_file, "--out", str(out)]

    can_diagnose = bool(settings.twin_file) and find_spec(SYSID.partition(".")[0]) is not None
    environment = {
        **os.environ,
        "ROS_DOMAIN_ID": str(node.context.get_domain_id()),
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{message}",
    }
    return Programs(record, READY, diagnose if can_diagnose else None, environment)
