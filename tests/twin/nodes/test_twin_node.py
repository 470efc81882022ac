"""The live twin over real topics: what it publishes is the stepper's trajectory, in order."""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from rclpy.parameter import Parameter  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from std_msgs.msg import Bool, Float64  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.real_time_user import TWIN, User, arrays, known_to, make_twin  # noqa: E402
from support.ros_graph import Graph  # noqa: E402

from pendulum_twin.emergency_stop import StopAnswer  # noqa: E402
from pendulum_twin.model import Twin, load_twin, save_twin  # noqa: E402
from pendulum_twin.nodes.clock_watch import STANDS  # noqa: E402
from pendulum_twin.nodes.messages import from_time, to_time  # noqa: E402
from pendulum_twin.nodes.qos import LATCHED  # noqa: E402
from pendulum_twin.stepper import Stepper  # noqa: E402

pytestmark = pytest.mark.wall_time  # samples come by the clock of this machine
RATE_HZ = 100.0
HANGING = [0.0, math.pi, 0.0, 0.0]


@pytest.fixture
def pair(ros: Graph):
    """Return twin and user, who know each other before the twin's first sample."""
    user = User(ros)
    twin = make_twin(ros, rate_hz=RATE_HZ, command_timeout_s=0.2)
    ros.executor.remove_node(twin)
    user.until(lambda: known_to(twin), "discovery of the user")
    user.until(lambda: user.sender.get_subscription_count() == 1, "discovery of the twin")
    ros.executor.add_node(twin)
    user.until(lambda: user.states and user.applied, "the first sample")
    return twin, user


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


def run_in_time_of_the_test(ros: Graph, commands: list[float]) -> User:
    """Drive a twin whose clock the test moves: each command arrives between two samples."""
    user = User(ros)
    twin = make_twin(ros, rate_hz=RATE_HZ, use_sim_time=True)
    clock = ros.user("clock").create_publisher(Clock, "/clock", 10)
    user.until(
        lambda: clock.get_subscription_count() and user.sender.get_subscription_count(),
        "discovery",
    )
    user.until(lambda: known_to(twin), "discovery of the user")

    def sample(k: int) -> None:
        now = Clock(clock=to_time(10**9 + k * 10_000_000))
        user.until(lambda: (clock.publish(now), len(user.states) > k)[1], f"sample {k}")

    for k, command in enumerate(commands):
        sample(k)
        user.send(command)
        user.until(lambda k=k: twin.count_figures().commands > k, f"command {k}")
    sample(len(commands))
    sample(len(commands) + 1)
    user.until(lambda: len(user.applied) == len(commands) + 1, "the last applied command")
    return user


COMMANDS = np.random.default_rng(11).uniform(-0.5, 0.5, 40).tolist()


def test_each_command_acts_from_the_sample_that_it_answers(ros: Graph) -> None:
    user = run_in_time_of_the_test(ros, COMMANDS)
    stamps, states = arrays(user)
    assert np.array_equal(stamps, 10**9 + 10_000_000 * np.arange(len(COMMANDS) + 2))
    assert user.applied == [*COMMANDS, COMMANDS[-1]]
    assert states.tobytes() == compute_trajectory([*COMMANDS, COMMANDS[-1]]).tobytes()
    for shifted in ([*COMMANDS[1:], 0.0, 0.0], [0.0, *COMMANDS]):  # a step early, a step late
        assert not np.array_equal(states, compute_trajectory(shifted))


def compute_trajectory(commands: list[float]) -> np.ndarray:
    stepper = Stepper(load_twin(TWIN), 1 / RATE_HZ)
    return np.array([stepper.state, *[stepper.step(command) for command in commands]])


def test_a_command_acts_after_it_arrived_and_stops_when_stale(pair) -> None:
    _, user = pair
    before = len(user.applied)
    user.send(0.25)
    user.until(lambda: 0.25 in user.applied[before:], "the command")
    user.until(lambda: user.applied[-1] == 0.0, "the end of the command")
    held_samples = user.applied[before:].count(0.25)
    assert 0 < held_samples <= 21  # 0.2 s, fewer when the machine stood still


def test_a_command_beyond_the_limit_is_clipped(pair) -> None:
    _, user = pair
    user.send(9.0)
    user.until(lambda: 0.5 in user.applied, "the clipped command")
    assert max(user.applied) == 0.5


def test_what_is_no_number_is_refused_and_counted(pair) -> None:
    twin, user = pair
    for bad in (math.nan, math.inf, -math.inf):
        refused = twin.count_figures().refused
        user.send(bad)
        user.until(
            lambda before=refused: twin.count_figures().refused == before + 1, "the refusal"
        )
    user.more(3)
    assert set(user.applied) == {0.0}
    assert np.all(np.isfinite(arrays(user)[1]))


def test_reset_hangs_the_pendulum_in_the_middle(pair) -> None:
    _, user = pair
    user.until(
        lambda: (user.send(0.4), user.more(1), abs(user.states[-1].position[0]) > 0.01)[-1],
        "motion",
    )
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
        broken.setattr(twin._live, "advance", lambda now_ns: 1 / 0)
        user.more(3)
    user.applied.clear()
    user.more(3)
    assert user.applied[-1] == 0.0
    monkeypatch.setattr(twin._live, "reset", lambda: 1 / 0)
    assert not user.reset().success


def test_another_twin_goes_on_from_the_present_state(pair, tmp_path) -> None:
    twin, user = pair
    other = Twin(
        "other",
        load_twin(TWIN).rig,
        {"input_delay": {"delay_s": 0.02}, "rail_tilt": {"angle_rad": 0.02}},
    )
    save_twin(other, tmp_path / "other.yaml")
    user.until(
        lambda: (user.send(0.4), user.more(1), abs(user.states[-1].position[0]) > 0.01)[-1],
        "motion",
    )
    swapped = twin.set_parameters([Parameter("twin", value=str(tmp_path / "other.yaml"))])[0]
    first = twin.count_figures().samples - 1  # the last sample of the twin before
    assert swapped.successful and twin.count_figures().twin == "other"
    for k in range(20):
        user.send(0.3 * math.cos(k))
        user.more(1)
    user.until(lambda: len(user.applied) >= len(user.states), "the last applied command")
    _, states = arrays(user)
    steps = Stepper(load_twin(TWIN), 1 / RATE_HZ, tuple(states[first]))
    later = Stepper(
        other, 1 / RATE_HZ, tuple(steps.step(user.applied[first])), before=user.applied[first]
    )
    for k in range(first + 1, len(states)):
        assert np.array_equal(states[k], later.state), f"sample {k}"
        later.step(user.applied[k])


def test_a_twin_that_is_none_is_refused_and_all_stays(pair, tmp_path) -> None:
    twin, user = pair
    (tmp_path / "bad.yaml").write_text(
        TWIN.read_text().replace("pwm_limit: 0.5", "pwm_limit: .nan")
    )
    result = twin.set_parameters([Parameter("twin", value=str(tmp_path / "bad.yaml"))])[0]
    assert not result.successful and "pwm_limit: expected a number" in result.reason
    assert not twin.set_parameters([Parameter("twin", value=3)])[0].successful
    assert twin.get_parameter("twin").value == str(TWIN) and twin.count_figures().twin == "inteco"
    user.more(3)


def test_the_largest_command_is_said_to_who_comes_late_and_follows_the_twin(
    ros: Graph, tmp_path: Path
) -> None:
    rig = load_twin(TWIN).rig
    for name, limit in (("volts", 6.0), ("without_limit", None)):
        save_twin(Twin(name, replace(rig, pwm_limit=limit), {}), tmp_path / f"{name}.yaml")
    twin, user = make_twin(ros), ros.user()
    said: list[float] = []
    user.create_subscription(Float64, "pwm_limit", lambda m: said.append(m.data), LATCHED)
    ros.until(lambda: said == [0.5], "the limit")
    for name, limit in (("volts", 6.0), ("without_limit", math.inf)):
        twin.set_parameters([Parameter("twin", value=str(tmp_path / f"{name}.yaml"))])
        ros.until(lambda limit=limit: said[-1] == limit, f"the limit of {name}")


def test_a_setting_of_rclpy_does_not_load_the_twin_anew(
    pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    twin, _ = pair
    monkeypatch.setattr(twin._live, "become", lambda other: pytest.fail("loaded"))
    assert twin.set_parameters([Parameter("use_sim_time", value=False)])[0].successful


@pytest.mark.parametrize("lockstep", [False, True])
def test_health_is_told_once_a_second(ros: Graph, lockstep: bool) -> None:
    reports: list[DiagnosticArray] = []
    user = User(ros)
    user.node.create_subscription(DiagnosticArray, "/diagnostics", reports.append, 10)
    twin = make_twin(ros, lockstep=lockstep)
    user.until(lambda: reports, "a report")
    assert reports[-1].status[0].level == b"\x00" and reports[-1].status[0].name == "/twin"
    user.until(lambda: user.sender.get_subscription_count(), "discovery")
    user.send(math.nan)
    user.until(lambda: twin.answer() or twin.count_figures().refused == 1, "the refusal")
    user.until(lambda: reports[-1].status[0].level == b"\x01", "a warning")
    said = reports[-1].status[0]
    # samples are lost where this computer stands still
    assert said.message.startswith("1 commands refused ")
    figures = {value.key: value.value for value in said.values}
    assert (
        figures["twin"] == "inteco"
        and figures["refused_commands"] == "1"
        and figures["command_age_s"] == "none"
    )
    assert set(figures) == {
        "twin", "samples", "commands", "refused_commands",
        "lost_samples", "applied_pwm", "command_age_s", "rail_end_impacts", "stopped",
    }  # fmt: skip
    user.until(lambda: reports[-1].status[0].level == b"\x00", "health again")
    stamps = [from_time(report.header.stamp) for report in reports]
    # in the mean: a report is late where the computer stands still, and the next is in time
    assert (stamps[-1] - stamps[0]) / (len(stamps) - 1) > 0.5e9


def test_a_pole_alone_has_one_joint(ros: Graph, tmp_path) -> None:
    text = "schema: pendulum_twin/1\nname: p\nrig:\n  pole_mass_kg: 0.1\n  com_distance_m: 0.1\n"
    (tmp_path / "pole.yaml").write_text(
        text + "  pole_inertia_kg_m2: 0.002\n  pole_viscous_n_m_s: 0.0\n"
    )
    make_twin(ros, twin=str(tmp_path / "pole.yaml"))
    user = User(ros)
    user.more(2)
    assert user.states[-1].name == ["pole"]
    assert arrays(user)[1][-1] == pytest.approx([math.pi, 0.0], abs=1e-12)


def test_the_stop_latches_in_the_twin_as_in_the_driver(pair) -> None:
    _, user = pair
    clients = {name: user.node.create_client(Trigger, name) for name in ("stop", "clear_stop")}
    stopped: list[bool] = []
    user.node.create_subscription(Bool, "stopped", lambda m: stopped.append(m.data), LATCHED)
    user.send(0.25)
    user.until(lambda: user.applied[-1] == 0.25, "the command")
    assert user.ros.call(clients["stop"]).success
    before = len(user.applied)
    user.until(lambda: stopped and stopped[-1], "the state")

    def push() -> bool:
        user.send(0.25)
        return len(user.applied) > before + 10

    user.until(push, "samples under the stop")
    assert set(user.applied[before + 1 :]) == {0.0}

    def is_refused() -> bool:
        user.send(0.25)
        if user.ros.call(clients["clear_stop"]).message == StopAnswer.ZERO_FIRST.value:
            return True
        user.ros.call(clients["stop"])  # this computer stood still, and silence counts as 0
        return False

    user.until(is_refused, "the refusal to clear the stop")
    assert not user.reset().success
    cleared = user.until(
        lambda: user.ros.call(clients["clear_stop"]).message == StopAnswer.CLEARED.value,
        "silence, which counts as 0",
    )
    assert cleared
    user.until(lambda: not stopped[-1], "the state")
    user.send(0.25)
    user.until(lambda: user.applied[-1] == 0.25, "a command after it")


def test_an_end_of_the_rail_is_an_event_in_diagnostics(pair) -> None:
    _, user = pair
    told: list[str] = []
    user.node.create_subscription(
        DiagnosticArray, "/diagnostics", lambda m: told.extend(s.message for s in m.status), 10
    )

    def push() -> bool:
        user.send(0.5)
        return any("hit the end of the rail at +0.9 m" in sentence for sentence in told)

    user.until(push, "the event")
    user.more(2)
    assert user.states[-1].position[0] == 0.9


def test_simulated_time_that_stands_still_is_said(ros: Graph) -> None:
    user = User(ros)
    told: list[tuple[bytes, str]] = []
    user.node.create_subscription(
        DiagnosticArray,
        "/diagnostics",
        lambda m: told.extend((s.level, s.message) for s in m.status),
        10,
    )
    make_twin(ros, use_sim_time=True)
    user.until(lambda: (b"\x02", STANDS) in told, "the sentence")
    clock = ros.user("clock").create_publisher(Clock, "/clock", 10)
    stamps = itertools.count(1)

    def tick() -> bool:
        clock.publish(Clock(clock=to_time(next(stamps) * 10_000_000)))
        return told[-1][0] == b"\x00" and len(user.states) > 3

    user.until(tick, "samples once /clock moves")
