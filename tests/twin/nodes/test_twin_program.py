"""The live twin as a program: its parameters, how it ends."""

import math
import re
import signal

import pytest

rclpy = pytest.importorskip("rclpy")
from rclpy.parameter import Parameter  # noqa: E402
from support.real_time_user import TWIN, make_twin  # noqa: E402
from support.ros_graph import Graph  # noqa: E402

from pendulum_twin.errors import BadInputError  # noqa: E402

MODULE = "pendulum_twin.nodes.twin_node"


def test_an_int_is_accepted_for_a_double(ros: Graph) -> None:
    assert make_twin(ros, rate_hz=50, command_timeout_s=1).get_parameter("rate_hz").value == 50


def test_parameters_say_what_they_are_and_stay_as_they_are(ros: Graph) -> None:
    node = make_twin(ros)
    described = node.describe_parameter("rate_hz")
    assert described.description == "samples a second" and described.read_only
    assert (
        described.floating_point_range[0].from_value,
        described.floating_point_range[0].to_value,
    ) == (1.0, 1000.0)
    assert not node.set_parameters([Parameter("rate_hz", value=50.0)])[0].successful


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"rate_hz": math.nan}, "rate_hz: expected a number from 1 to 1000, found nan"),
        ({"rate_hz": 0}, "rate_hz: expected a number from 1 to 1000, found 0"),
        ({"rate_hz": "fast"}, "rate_hz: expected a number, found 'fast'"),
        (
            {"command_timeout_s": -1.0},
            "command_timeout_s: expected a number from 0.001 to 60, found -1.0",
        ),
        ({"twin": 3}, "twin: expected text, found 3"),
        ({"twin": ""}, "twin: expected the path of a twin file, found none: give -p twin:=FILE"),
        ({"twin": "/no/such.yaml"}, "/no/such.yaml: expected a twin file"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(
    ros: Graph, values: dict, sentence: str
) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        make_twin(ros, **values)


@pytest.mark.parametrize(
    ("arguments", "status", "sentence"),
    [
        (
            ["--ros-args", "-p", "twin:=/no/such.yaml"],
            1,
            "twin_node: /no/such.yaml: expected a twin file",
        ),
        (["--ros-args", "-p", "twin:=broken.yaml"], 1, "expected schema: pendulum_twin/1"),
        (["--ros-args", "-p"], 2, "twin_node: wrong --ros-args"),
        (["--ros-args", "-p", "twin:="], 2, "an empty text is written -p \"twin:=''\""),
        (["--speed"], 2, "unrecognized arguments: --speed"),
    ],
)
def test_what_cannot_run_ends_with_a_sentence(
    ros: Graph, arguments, status, sentence, tmp_path
) -> None:
    (tmp_path / "broken.yaml").write_text("schema: other\n")
    node = ros.start(
        MODULE, *[a.replace("broken.yaml", str(tmp_path / "broken.yaml")) for a in arguments]
    )
    _, said = node.communicate(timeout=600)
    assert node.returncode == status
    assert sentence in said and "Traceback" not in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(ros: Graph, number: signal.Signals) -> None:
    node = ros.start(MODULE, "--ros-args", "-p", f"twin:={TWIN}")
    lines = iter(node.stderr.readline, "")  # the first start on a machine compiles before
    assert any("runs at 100 Hz" in line for line in lines)
    node.send_signal(number)
    _, said = node.communicate(timeout=600)
    assert node.returncode == 0 and said == ""
