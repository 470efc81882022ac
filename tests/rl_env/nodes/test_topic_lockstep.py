"""The environment over real topics, on a twin in lockstep."""

import warnings
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from support.lockstep_user import LockstepUser  # noqa: E402
from support.paths import CONFIG  # noqa: E402
from support.served_twin import served_twin  # noqa: E402

import pendulum_rl_env  # noqa: E402, F401
from pendulum_rl_env.in_process import make_twin_env  # noqa: E402
from pendulum_rl_env.kernel_transport import KernelTransport  # noqa: E402
from pendulum_rl_env.nodes.ros_env import make_ros_env  # noqa: E402
from pendulum_rl_env.nodes.topic_transport import TopicTransport  # noqa: E402
from pendulum_rl_env.transport import NoAnswerError  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402
from pendulum_twin.model import Twin, load_twin, save_twin  # noqa: E402

INTECO = CONFIG / "inteco.yaml"
EFFECTS = {"input_delay": {"delay_s": 0.013}, "cart_coulomb_friction": {"level_n": 0.8}}
DELAYED = Twin("delayed", load_twin(INTECO).rig, EFFECTS)
COMMANDS = np.random.default_rng(3).uniform(-0.6, 0.6, 60).tolist()


@pytest.fixture
def domain(ros, monkeypatch: pytest.MonkeyPatch):
    """Let environments find the graph's domain, as a user does."""
    monkeypatch.setenv("ROS_DOMAIN_ID", str(ros.domain))
    return ros


@pytest.fixture
def transport(domain, tmp_path):
    """Return a transport to a twin that runs at 100 Hz."""
    save_twin(DELAYED, tmp_path / "delayed.yaml")
    with served_twin(domain, "", lockstep=True, twin=str(tmp_path / "delayed.yaml")):
        transport = TopicTransport("", lockstep=True)
        try:
            yield transport
        finally:
            transport.close()


def run_states(transport: KernelTransport | TopicTransport, commands: list[float]) -> bytes:
    first = transport.reset()
    return np.array(
        [first.state, *[transport.exchange(command).state for command in commands]]
    ).tobytes()


def test_an_episode_is_that_of_the_twin_in_process(transport: TopicTransport) -> None:
    assert run_states(transport, COMMANDS) == run_states(KernelTransport(DELAYED, 0.03), COMMANDS)


@pytest.mark.parametrize("shifted", [COMMANDS[1:], [0.0, *COMMANDS[:-1]]])
def test_a_shift_by_one_command_would_show(
    transport: TopicTransport, shifted: list[float]
) -> None:
    assert run_states(transport, COMMANDS[: len(shifted)]) != run_states(
        KernelTransport(DELAYED, 0.03), shifted
    )


def test_a_reset_amid_an_episode_begins_another(transport: TopicTransport) -> None:
    first = run_states(transport, COMMANDS[:20])
    assert run_states(transport, COMMANDS[:20]) == first
    samples = [transport.exchange(command) for command in COMMANDS[20:30]]
    assert {sample.info["dt_s"] for sample in samples} == {0.03}
    for name in ("delay_s", "age_s", "overrun_s", "missed", "lost", "stale"):
        assert {sample.info[name] for sample in samples} == {0.0}
    assert all(sample.info["latency_s"] > 0.0 for sample in samples)


def test_a_sample_a_step_does_as_well(domain) -> None:
    with served_twin(domain, "", lockstep=True, twin=str(INTECO), rate_hz=100.0):
        transport = TopicTransport("", lockstep=True, step_s=0.01)
        try:
            there = run_states(transport, COMMANDS)
        finally:
            transport.close()
    assert there == run_states(KernelTransport(load_twin(INTECO), 0.01), COMMANDS)


def test_somebody_elses_commands_are_noticed(transport: TopicTransport, domain) -> None:
    other = LockstepUser(domain, "other")
    domain.until(other.known, "discovery")
    transport.reset()
    transport.exchange(0.1)
    other.samples.clear()
    other.step(0.5)
    assert [transport.exchange(0.1).info["stale"] for _ in range(2)][-1] == 1.0


def test_two_environments_of_one_process_do_not_meet(transport: TopicTransport, domain) -> None:
    with served_twin(domain, "second", lockstep=True, twin=str(INTECO)):
        second = TopicTransport("/second/", lockstep=True)
        try:
            expected = KernelTransport(DELAYED, 0.03), KernelTransport(load_twin(INTECO), 0.03)
            for ours, theirs in zip((transport, second), expected, strict=True):
                ours.reset()
                theirs.reset()
            for command in COMMANDS[:10]:
                for ours, theirs in zip((transport, second), expected, strict=True):
                    assert np.array_equal(
                        ours.exchange(command).state, theirs.exchange(command).state
                    )
        finally:
            second.close()


def test_gymnasium_finds_nothing_wrong(domain) -> None:
    with served_twin(domain, "rig", lockstep=True, twin=str(INTECO)):
        env = gym.make(
            "pendulum_rl_env/InvertedPendulumRos-v0", lockstep=True, render_mode="rgb_array"
        )
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                warnings.filterwarnings(
                    "ignore", message=".*environment after unwrapping|.*isn't `None`|.*different"
                )
                check_env(env.unwrapped, skip_render_check=True)
        finally:
            env.close()


def test_policies_carry_over(domain) -> None:
    with served_twin(domain, "rig", lockstep=True, twin=str(INTECO)):
        there, here = make_ros_env(lockstep=True), make_twin_env(INTECO)
        try:
            assert (
                there.action_space == here.action_space
                and there.observation_space == here.observation_space
            )
            assert np.array_equal(there.reset()[0], here.reset()[0])
            for value in COMMANDS:
                action = np.array([value], dtype=np.float32)
                ours, theirs = there.step(action), here.step(action)
                assert np.array_equal(ours[0], theirs[0]) and ours[1:4] == theirs[1:4]
        finally:
            there.close()


def test_a_smaller_limit_of_the_rig_is_known(domain, tmp_path) -> None:
    save_twin(Twin("weak", replace(DELAYED.rig, pwm_limit=0.2)), tmp_path / "weak.yaml")
    with served_twin(domain, "rig", lockstep=True, twin=str(tmp_path / "weak.yaml")):
        env = make_ros_env(lockstep=True)
        try:
            env.reset()
            for action, applied in ((1.0, 0.2), (0.2, 0.1)):
                info = env.step(np.array([action], dtype=np.float32))[4]
                assert info["applied_pwm"] == pytest.approx(applied, abs=1e-6)
                assert info["pwm_limit"] == 0.2
        finally:
            env.close()


def test_wrong_use_is_told_in_a_sentence(transport: TopicTransport) -> None:
    with pytest.raises(BadInputError, match="expected a reset before the first command"):
        transport.exchange(0.0)
    transport.reset()
    with pytest.raises(BadInputError, match="expected a finite PWM fraction, found nan"):
        transport.exchange(float("nan"))
    transport.close()
    transport.close()
    for use in (transport.reset, lambda: transport.exchange(0.0)):
        with pytest.raises(NoAnswerError, match="expected an open transport, found it closed"):
            use()
    with pytest.raises(BadInputError, match="namespace: expected letters, digits and _"):
        TopicTransport("no rig")
    with pytest.raises(BadInputError, match="deadline_s"):
        TopicTransport(deadline_s=0.01)


def test_a_twin_in_lockstep_is_not_taken_for_a_rig(transport: TopicTransport) -> None:
    other = TopicTransport("", lockstep=False)
    try:
        with pytest.raises(BadInputError, match="found a twin in lockstep: give lockstep=True"):
            other.reset()
    finally:
        other.close()
