"""The live twin over real topics: what it publishes is the stepper's trajectory, in order."""

import math
import re
import signal
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from rclpy.parameter import Parameter  # noqa: E402
from ros_graph import Graph  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from pendulum_twin.errors import BadInputError  # noqa: E402
from pendulum_twin.model import load_twin  # noqa: E402
from pendulum_twin.nodes.twin_node import TwinNode  # noqa: E402
from pendulum_twin.stepper import Stepper  # noqa: E402

CONFIG = Path(__file__).parents[2] / "config"
TWIN = CONFIG / "inteco.yaml"
MODULE = "pendulum_twin.nodes.twin_node"
RATE_HZ = 100.0
HANGING = [0.0, math.pi, 0.0, 0.0]


class User:
    """Send commands and keep what comes back."""

    def __init__(self, ros: Graph) -> None:
        node = ros.user()
        self.ros = ros
        self.states: list[JointState] = []
        self.applied: list[float] = []
        node.create_subscription(JointState, "joint_states", self.states.append, 100)
        node.create_subscription(Float64, "applied_pwm", lambda m: self.applied.append(m.data), 100)
        self.sender = node.create_publisher(Float64, "pwm", 1)
        self.resetter = node.create_client(Trigger, "reset")
        self.until = ros.until

    def more(self, count: int) -> None:
        wanted = len(self.states) + count
        self.until(lambda: len(self.states) >= wanted, f"{count} samples")

    def send(self, value: float) -> None:
        self.sender.publish(Float64(data=value))

    def reset(self) -> Trigger.Response:
        return self.ros.call(self.resetter)


def make_twin(ros: Graph, **values: object) -> TwinNode:
    return ros.add(TwinNode, **{"twin": str(TWIN), **values})


@pytest.fixture
def pair(ros: Graph):
    """Return twin and user who know one another before the twin's first sample: both lists begin with it."""
    user = User(ros)
    twin = make_twin(ros, rate_hz=RATE_HZ, command_timeout_s=0.2)
    ros.executor.remove_node(twin)
    ours = [p for p in twin.publishers if p.topic_name in ("/joint_states", "/applied_pwm")]
    user.until(lambda: all(p.get_subscription_count() == 1 for p in ours), "discovery of the user")
    user.until(lambda: user.sender.get_subscription_count() == 1, "discovery of the twin")
    ros.executor.add_node(twin)
    user.until(lambda: user.states and user.applied, "the first sample")
    return twin, user


def arrays(user: User) -> tuple[np.ndarray, np.ndarray]:
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in user.states])
    return stamps, np.array([[*m.position, *m.velocity] for m in user.states])


def test_samples_are_the_steppers_in_order(pair) -> None:
    _, user = pair
    for k in range(80):
        user.send(0.3 * math.cos(0.06 * k))
        user.more(1)
    user.until(lambda: len(user.applied) >= len(user.states), "the last applied command")
    stamps, states = arrays(user)
    stepper = Stepper(load_twin(TWIN), 1 / RATE_HZ)
    for k in range(len(states)):
        assert np.array_equal(states[k], stepper.state), f"sample {k}"
        stepper.step(user.applied[k])
    assert np.max(np.abs(states[:, 0])) > 0.01
    assert np.mean(np.diff(stamps) == 10_000_000) > 0.9  # all, unless the machine stood still
    assert user.states[0].name == ["cart", "pole"]


def test_a_command_acts_after_it_arrived_and_stops_when_stale(pair) -> None:
    _, user = pair
    before = len(user.applied)
    user.send(0.25)
    user.until(lambda: 0.25 in user.applied[before:], "the command")
    user.until(lambda: user.applied[-1] == 0.0, "the end of the command")
    held = user.applied[before:].count(0.25)
    assert 0 < held <= 21  # 0.2 s, fewer when the machine stood still


def test_a_command_beyond_the_limit_is_clipped(pair) -> None:
    _, user = pair
    user.send(9.0)
    user.until(lambda: 0.5 in user.applied, "the clipped command")
    assert max(user.applied) == 0.5


def test_what_is_no_number_is_refused_and_counted(pair) -> None:
    twin, user = pair
    for bad in (math.nan, math.inf, -math.inf):
        refused = twin.refused
        user.send(bad)
        user.until(lambda before=refused: twin.refused == before + 1, "the refusal")
    user.more(3)
    assert set(user.applied) == {0.0}
    assert np.all(np.isfinite(arrays(user)[1]))


def test_reset_hangs_the_pendulum_in_the_middle(pair) -> None:
    _, user = pair
    user.until(lambda: (user.send(0.4), user.more(1), abs(user.states[-1].position[0]) > 0.01)[-1], "motion")
    answer = user.reset()
    assert answer.success and "hangs at rest" in answer.message
    user.until(lambda: np.array_equal(arrays(user)[1][-1], HANGING), "hanging at rest")
    user.more(5)
    assert arrays(user)[1][-1] == pytest.approx(HANGING, abs=1e-12)  # the old command is forgotten


def test_a_failing_callback_does_not_kill_the_node(pair, monkeypatch: pytest.MonkeyPatch) -> None:
    twin, user = pair
    user.send(0.4)
    user.until(lambda: 0.4 in user.applied, "the command")
    with monkeypatch.context() as broken:
        broken.setattr(twin._stepper, "step", lambda command: 1 / 0)
        user.more(3)
    user.applied.clear()
    user.more(3)
    assert user.applied[-1] == 0.0
    monkeypatch.setattr(twin._stepper, "reset", lambda: 1 / 0)
    assert not user.reset().success


def test_a_pole_alone_has_one_joint(ros: Graph, tmp_path) -> None:
    text = "schema: pendulum_twin/1\nname: p\nrig:\n  pole_mass_kg: 0.1\n  com_distance_m: 0.1\n"
    (tmp_path / "pole.yaml").write_text(text + "  pole_inertia_kg_m2: 0.002\n  pole_viscous_n_m_s: 0.0\n")
    make_twin(ros, twin=str(tmp_path / "pole.yaml"))
    user = User(ros)
    user.more(2)
    assert user.states[-1].name == ["pole"]
    assert arrays(user)[1][-1] == pytest.approx([math.pi, 0.0], abs=1e-12)


def test_an_int_is_accepted_for_a_double(ros: Graph) -> None:
    assert make_twin(ros, rate_hz=50, command_timeout_s=1).get_parameter("rate_hz").value == 50


def test_parameters_say_what_they_are_and_stay_as_they_are(ros: Graph) -> None:
    node = make_twin(ros)
    described = node.describe_parameter("rate_hz")
    assert described.description == "samples a second" and described.read_only
    assert (described.floating_point_range[0].from_value, described.floating_point_range[0].to_value) == (1.0, 1000.0)
    assert not node.set_parameters([Parameter("rate_hz", value=50.0)])[0].successful


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"rate_hz": math.nan}, "rate_hz: expected a number from 1 to 1000, found nan"),
        ({"rate_hz": 0}, "rate_hz: expected a number from 1 to 1000, found 0"),
        ({"rate_hz": "fast"}, "rate_hz: expected a number, found 'fast'"),
        ({"command_timeout_s": -1.0}, "command_timeout_s: expected a number from 0.001 to 60, found -1.0"),
        ({"twin": 3}, "twin: expected text, found 3"),
        ({"twin": ""}, "twin: expected the path of a twin file, found none: give -p twin:=FILE"),
        ({"twin": "/no/such.yaml"}, "/no/such.yaml: expected a twin file"),
    ],
)
def test_wrong_parameters_are_refused_in_a_sentence(ros: Graph, values: dict, sentence: str) -> None:
    with pytest.raises(BadInputError, match=re.escape(sentence)):
        make_twin(ros, **values)


@pytest.mark.parametrize(
    ("arguments", "status", "sentence"),
    [
        (["--ros-args", "-p", "twin:=/no/such.yaml"], 1, "twin_node: /no/such.yaml: expected a twin file"),
        (["--ros-args", "-p", "twin:=broken.yaml"], 1, "expected schema: pendulum_twin/1"),
        (["--ros-args", "-p"], 2, "twin_node: wrong --ros-args"),
        (["--speed"], 2, "unrecognized arguments: --speed"),
    ],
)
def test_what_cannot_run_ends_with_a_sentence(ros: Graph, arguments, status, sentence, tmp_path) -> None:
    (tmp_path / "broken.yaml").write_text("schema: other\n")
    node = ros.start(MODULE, *[a.replace("broken.yaml", str(tmp_path / "broken.yaml")) for a in arguments])
    _, said = node.communicate(timeout=60)
    assert node.returncode == status
    assert sentence in said and "Traceback" not in said


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_cleanly(ros: Graph, number: signal.Signals) -> None:
    node = ros.start(MODULE, "--ros-args", "-p", f"twin:={TWIN}")
    assert "runs at 100 Hz" in node.stderr.readline()
    node.send_signal(number)
    _, said = node.communicate(timeout=60)
    assert node.returncode == 0 and said == ""
