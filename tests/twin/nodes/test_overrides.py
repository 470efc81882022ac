"""Parameters that nobody reads are refused, with the nearest name."""

import re
from pathlib import Path

import pytest

pytest.importorskip("rclpy")
from rclpy.node import Node
from support.real_time_user import TWIN, make_twin
from support.ros_graph import Graph

from pendulum_bridge.nodes import driver_node
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.overrides import check_parameter_files

MODULE = "pendulum_twin.nodes.twin_node"
SOURCE = Path(driver_node.__file__).parent


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        (
            "comand_timeout_s",
            "comand_timeout_s: expected a parameter of /twin, found none of this name; "
            "the nearest name is command_timeout_s",
        ),
        ("unheard_of", "unheard_of: expected a parameter of /twin, found none of this name"),
    ],
)
def test_a_misspelt_parameter_is_refused(ros: Graph, name: str, sentence: str) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        make_twin(ros, **{name: 0.1})


def test_what_rclpy_declares_itself_is_taken(ros: Graph) -> None:
    make_twin(ros, use_sim_time=False, start_type_description_service=True)


@pytest.mark.parametrize(
    ("head", "taken"),
    [
        ("/**", True),
        ("driver", False),
        ("/rig/driver", True),
        ("rig/driver", True),
        ("/*/driver", True),
        ("/rig/*", True),
        ("/**/driver", True),
        ("/*", False),
        ("/driver", False),
        ("/rig/driver_node", False),
    ],
)
def test_a_file_must_name_the_node(ros: Graph, tmp_path: Path, head: str, taken: bool) -> None:
    file = tmp_path / "limits.yaml"
    file.write_text(f"{head}:\n  ros__parameters:\n    pwm_limit: 0.1\n")
    arguments = ["--ros-args", "--params-file", str(file)]
    node = ros.serve(Node("driver", namespace="rig", context=ros.context, cli_args=arguments))
    assert (node._parameter_overrides != {}) == taken, "rclpy matches otherwise"
    if taken:
        check_parameter_files(node.get_fully_qualified_name(), arguments)
    else:
        with pytest.raises(BadInputError, match=r"expected parameters of /rig/driver, found only"):
            check_parameter_files(node.get_fully_qualified_name(), arguments)


def test_a_file_may_nest_namespaces(ros: Graph, tmp_path: Path) -> None:
    file = tmp_path / "limits.yaml"
    file.write_text("rig:\n  driver:\n    ros__parameters:\n      pwm_limit: 0.1\n")
    arguments = ["--ros-args", "--params-file", str(file)]
    node = ros.serve(Node("driver", namespace="rig", context=ros.context, cli_args=arguments))
    assert node._parameter_overrides
    check_parameter_files(node.get_fully_qualified_name(), arguments)


@pytest.mark.parametrize(
    ("text", "status", "sentence"),
    [
        (None, 2, "wrong --ros-args"),
        ("/**:\n  ros__parameters: {comand_timeout_s: 1.0}\n", 1, "nearest name is command_time"),
        ("/driver:\n  ros__parameters: {rate_hz: 50.0}\n", 1, "expected parameters of /twin"),
    ],
    ids=["missing", "misspelt", "of another node"],
)
def test_a_program_refuses_a_wrong_file(ros, tmp_path, text, status, sentence) -> None:
    file = tmp_path / "twin.yaml"
    if text:
        file.write_text(text)
    program = ros.start(MODULE, "--ros-args", "-p", f"twin:={TWIN}", "--params-file", file)
    _, said = program.communicate(timeout=600)
    assert program.returncode == status and sentence in said and "Traceback" not in said


def test_a_file_in_utf_16_is_read_as_rclpy_reads_it(ros: Graph, tmp_path: Path) -> None:
    file = tmp_path / "limits.yaml"
    file.write_bytes("/**:\n  ros__parameters:\n    pwm_limit: 0.1\n".encode("utf-16"))
    arguments = ["--ros-args", "--params-file", str(file)]
    node = ros.serve(Node("driver", namespace="rig", context=ros.context, cli_args=arguments))
    assert node._parameter_overrides["pwm_limit"].value == 0.1
    check_parameter_files(node.get_fully_qualified_name(), arguments)


def test_a_file_that_does_not_fit_is_refused_before_anything_is_made(ros, tmp_path) -> None:
    """A recording that was begun would refuse the corrected command line."""
    file, out = tmp_path / "recorder.yaml", tmp_path / "recording"
    file.write_text("/driver:\n  ros__parameters: {rate_hz: 50.0}\n", encoding="utf-8")
    words = ("--ros-args", "-r", "__ns:=/lab", "-p", f"out:={out}", "--params-file", file)
    program = ros.start("pendulum_bridge.nodes.recorder_node", *words)
    _, said = program.communicate(timeout=600)
    assert program.returncode == 1 and "expected parameters of /lab/recorder" in said
    assert not out.exists()


@pytest.mark.parametrize("name", ["driver", "excitation", "recorder", "view", "watch"])
def test_programs_are_named_after_their_nodes(name: str) -> None:
    """`running.run` takes the node's name from that of the program."""
    source = (SOURCE / f"{name}_node.py").read_text(encoding="utf-8")
    assert f'super().__init__("{name}", **options)' in source
    assert f'"{name}_node"' in source
