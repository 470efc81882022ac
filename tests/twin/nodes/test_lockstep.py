"""Lockstep over real topics: one command in, one sample out, to the last bit."""

import math
import signal
import time
from itertools import pairwise
from threading import Event

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from rosgraph_msgs.msg import Clock  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402
from support.lockstep_user import LockstepUser  # noqa: E402
from support.paths import CONFIG  # noqa: E402
from support.served_twin import served_twin  # noqa: E402

from pendulum_twin.model import Twin, load_twin, save_twin  # noqa: E402
from pendulum_twin.nodes import twin_node  # noqa: E402
from pendulum_twin.nodes.direct import DirectSubscription  # noqa: E402
from pendulum_twin.nodes.messages import from_time  # noqa: E402
from pendulum_twin.nodes.qos import SAMPLES  # noqa: E402
from pendulum_twin.nodes.twin_node import TwinNode  # noqa: E402
from pendulum_twin.stepper import Stepper  # noqa: E402

TWIN_FILE = CONFIG / "inteco.yaml"
RIG = load_twin(TWIN_FILE).rig
DELAYED = Twin(
    "delayed", RIG, {"input_delay": {"delay_s": 0.013}, "cart_coulomb_friction": {"level_n": 0.8}}
)
PERIOD_S, PERIOD_NS = 0.01, 10_000_000
HANGING = [0.0, math.pi, 0.0, 0.0]
COMMANDS = np.random.default_rng(7).uniform(-0.5, 0.5, 1000).tolist()


@pytest.fixture
def pair(ros, tmp_path):
    """Return twin and user, who has the start state and may send its first command."""
    save_twin(DELAYED, tmp_path / "delayed.yaml")
    with served_twin(ros, lockstep=True, twin=str(tmp_path / "delayed.yaml")) as twin:
        user = LockstepUser(ros)
        user.begin()
        user.applied.clear()
        yield twin, user


def compute_trajectory(commands: list[float]) -> np.ndarray:
    stepper = Stepper(DELAYED, PERIOD_S)
    return np.array([stepper.step(command) for command in commands])


def test_a_thousand_commands_are_answered_in_order_each_once(pair) -> None:
    twin, user = pair
    begin_ns, _ = user.reset()
    before = twin.count_figures()
    answers = [user.step(command) for command in COMMANDS]
    assert (
        np.array([state for _, state in answers]).tobytes()
        == compute_trajectory(COMMANDS).tobytes()
    )
    assert [stamp - begin_ns for stamp, _ in answers] == [
        (k + 1) * PERIOD_NS for k in range(len(COMMANDS))
    ]
    assert user.samples.wait(0.2) is None  # and no sample more
    after = twin.count_figures()
    assert (after.samples - before.samples, after.commands - before.commands) == (1000, 1000)


@pytest.mark.parametrize("shift", [-1, 1])
def test_a_shift_by_one_step_shows(pair, shift: int) -> None:
    _, user = pair
    user.reset()
    answers = np.array([user.step(command)[1] for command in COMMANDS[:20]])
    shifted = COMMANDS[1:21] if shift < 0 else [0.0, *COMMANDS[:19]]
    assert np.array_equal(answers, compute_trajectory(COMMANDS[:20]))
    assert not np.array_equal(answers, compute_trajectory(shifted))
    assert not np.array_equal(answers[1:], compute_trajectory(COMMANDS[:20])[:-1])


def test_what_was_applied_is_told_once_for_each_command(pair) -> None:
    _, user = pair
    for command, held in ((0.3, 0.3), (9.0, 0.5), (-9.0, -0.5)):
        user.step(command)
        assert user.applied.wait(20.0).data == held
    assert user.applied.take() is None


def test_time_stands_still_without_commands(pair) -> None:
    _, user = pair
    begin_ns, _ = user.reset()
    first = user.step(0.4)
    assert user.samples.wait(0.5) is None  # longer than a command counts as fresh in real time
    second = user.step(0.4)
    assert np.array([first[1], second[1]]).tobytes() == compute_trajectory([0.4, 0.4]).tobytes()
    assert second[0] == begin_ns + 2 * PERIOD_NS


def test_commands_that_wait_are_answered_in_order(pair) -> None:
    _, user = pair
    user.reset()
    for command in COMMANDS[:3]:
        user.send(command)
        user.sender.wait_for_all_acked()
    answers = [user.sample(20.0)[1] for _ in range(3)]
    assert np.array(answers).tobytes() == compute_trajectory(COMMANDS[:3]).tobytes()


def test_a_reset_forgets_everything_but_the_time(pair) -> None:
    _, user = pair
    first = [user.reset(), *[user.step(command) for command in COMMANDS[:30]]]
    second = [user.reset(), *[user.step(command) for command in COMMANDS[:30]]]
    assert [state.tolist() for _, state in first] == [state.tolist() for _, state in second]
    assert second[0][1].tolist() == HANGING
    stamps = [stamp for stamp, _ in first + second]
    assert set(np.diff(stamps)) == {PERIOD_NS}


def test_who_comes_late_gets_going_by_a_reset(pair) -> None:
    _, user = pair
    last_ns, _ = user.step(0.5)
    late = LockstepUser(user.ros, "late")
    stamp_ns, state = late.begin()
    assert state.tolist() == HANGING and stamp_ns > last_ns
    assert late.step(0.2)[1].tobytes() == compute_trajectory([0.2])[0].tobytes()


def test_what_is_no_number_gets_no_answer(pair) -> None:
    twin, user = pair
    user.reset()
    for count, bad in enumerate((math.nan, math.inf, -math.inf), 1):
        user.send(bad)
        user.ros.until(lambda count=count: twin.count_figures().refused == count, "the refusal")
    assert user.samples.wait(0.2) is None
    assert user.step(0.3)[1].tobytes() == compute_trajectory([0.3])[0].tobytes()


def test_the_clock_follows_the_samples_and_spares_its_listeners(pair) -> None:
    _, user = pair
    clock = DirectSubscription(user.node, Clock, "/clock", SAMPLES)
    user.ros.until(lambda: (user.step(0.1), clock.take())[1], "the clock")
    clock.clear()
    seen, begin = [], time.monotonic()
    for command in COMMANDS[:500]:
        now_ns, _ = user.step(command)
        while (message := clock.take()) is not None:
            seen.append(from_time(message.clock))
            assert seen[-1] <= now_ns  # never ahead
    took_s = time.monotonic() - begin
    while not seen or seen[-1] != now_ns:
        message = clock.wait(20.0)
        assert message is not None, "the clock stays behind"
        seen.append(from_time(message.clock))
    assert np.all(np.diff(seen) > 0)
    assert len(seen) <= took_s / 0.01 + 3


def test_another_twin_goes_on_from_the_present_state(pair, tmp_path) -> None:
    twin, user = pair
    user.reset()
    before = [user.step(command)[1] for command in COMMANDS[:20]]
    other = Twin(
        "other", RIG, {"motor_lag": {"time_constant_s": 0.03}, "angle_offset": {"angle_rad": 0.05}}
    )
    save_twin(other, tmp_path / "other.yaml")
    assert user.set_twin(tmp_path / "other.yaml").successful
    assert (
        twin.get_parameter("twin").value == str(tmp_path / "other.yaml")
        and twin.count_figures().twin == "other"
    )
    stepper = Stepper(other, PERIOD_S, tuple(before[-1]), before=COMMANDS[19])
    for command in COMMANDS[20:40]:
        assert user.step(command)[1].tobytes() == stepper.step(command).tobytes()
    assert user.reset()[1].tolist() == pytest.approx(
        [0.0, np.pi + 0.05, 0.0, 0.0], abs=1e-12
    )  # by its weight


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        (None, "expected a twin file, but it cannot be read"),
        ("schema: pendulum_twin/1\nname: x\nrig: {}\n", "expected a cart"),
        ("schema: pendulum_twin/1\nname: 2024-13-45\n", "expected 'rig' to be a mapping"),
        ("[" * 2000, "levels of nesting"),
    ],
)
def test_a_twin_that_is_none_is_refused_and_all_stays(
    pair, tmp_path, text: str | None, sentence: str
) -> None:
    twin, user = pair
    user.reset()
    if text is not None:
        (tmp_path / "bad.yaml").write_text(text)
    answers = [user.step(command)[1] for command in COMMANDS[:5]]
    result = user.set_twin(tmp_path / "bad.yaml")
    assert not result.successful and sentence in result.reason
    assert twin.get_parameter("twin").value == str(tmp_path / "delayed.yaml")
    answers += [user.step(command)[1] for command in COMMANDS[5:10]]
    assert np.array(answers).tobytes() == compute_trajectory(COMMANDS[:10]).tobytes()


def test_a_step_that_fails_gives_no_answer_and_ends_nothing(
    pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    twin, user = pair
    user.reset()
    with monkeypatch.context() as broken:
        broken.setattr(twin._live, "advance", lambda now_ns: 1 / 0)
        user.send(0.3)
        assert user.samples.wait(0.3) is None
    assert user.step(0.3)[1].tobytes() == compute_trajectory([0.3])[0].tobytes()


def test_a_reset_waits_for_the_step_that_is_under_way(
    pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    twin, user = pair
    user.reset()
    entered, go_on, advance = Event(), Event(), twin._live.advance
    monkeypatch.setattr(
        twin._live, "advance", lambda now_ns: (entered.set(), go_on.wait(20.0), advance(now_ns))[2]
    )
    try:
        user.send(0.4)
        assert entered.wait(20.0)
        answer = user.resetter.call_async(Trigger.Request())
        assert user.samples.wait(0.3) is None and not answer.done()
    finally:
        go_on.set()
    assert user.sample(20.0)[1].tobytes() == compute_trajectory([0.4])[0].tobytes()
    assert user.sample(20.0)[1].tolist() == HANGING


def test_a_reset_drops_commands_that_wait(ros) -> None:
    twin = ros.add(TwinNode, twin=str(TWIN_FILE), lockstep=True)  # nothing serves its commands
    user = LockstepUser(ros)
    ros.until(user.known, "discovery")
    for command in (0.4, 0.3):
        user.send(command)
        user.sender.wait_for_all_acked()
    assert user.reset()[1].tolist() == HANGING
    assert not twin.answer() and user.samples.wait(0.1) is None


def test_resets_between_commands_keep_the_order(ros) -> None:
    """Resets have another thread: each sample is the start state or a step from the last."""
    with served_twin(ros, lockstep=True, twin=str(TWIN_FILE)) as twin:
        user = LockstepUser(ros)
        user.begin()
        begin = twin.count_figures().samples
        for k in range(20):
            answer = user.resetter.call_async(user.resetter.srv_type.Request())
            samples = []
            while not answer.done():
                user.send(0.4)
                user.ros.executor.spin_once(timeout_sec=0)
                while (sample := user.sample(0.02)) is not None:
                    samples.append(sample)
            while len(samples) < twin.count_figures().samples - begin:
                samples.append(user.sample(20.0))
            begin = twin.count_figures().samples
            assert k == 0 or set(np.diff([stamp for stamp, _ in samples])) <= {PERIOD_NS}
            assert HANGING in [state.tolist() for _, state in samples]
            for (_, state), (_, following) in pairwise(samples):
                step = Stepper(load_twin(TWIN_FILE), PERIOD_S, tuple(state)).step(0.4)
                assert following.tolist() in (HANGING, step.tolist())


def test_it_does_not_go_on_without_its_services(ros, monkeypatch: pytest.MonkeyPatch) -> None:
    twin = ros.add(TwinNode, twin=str(TWIN_FILE), lockstep=True)
    monkeypatch.setattr(twin_node, "spin", lambda node, stopped: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        twin_node.serve(twin, Event())


def test_a_program_in_lockstep_answers_and_ends_cleanly(ros) -> None:
    program = ros.start(
        "pendulum_twin.nodes.twin_node",
        "--ros-args",
        "-p",
        f"twin:={TWIN_FILE}",
        "-p",
        "lockstep:=true",
        "-p",
        "rate_hz:=300",
    )
    user = LockstepUser(ros)
    user.begin()
    stepper = Stepper(load_twin(TWIN_FILE), 1 / 300)
    answers = [user.step(command) for command in COMMANDS[:100]]
    assert (
        np.array([state for _, state in answers]).tobytes()
        == np.array(list(map(stepper.step, COMMANDS[:100]))).tobytes()
    )
    assert set(np.diff([stamp for stamp, _ in answers])) == {3_333_333, 3_333_334}
    program.send_signal(signal.SIGTERM)
    _, said = program.communicate(timeout=60)
    assert program.returncode == 0 and "in lockstep" in said and "Traceback" not in said
