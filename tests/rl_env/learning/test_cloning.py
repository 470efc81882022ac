"""A policy copies classical controllers before it learns by itself."""

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from support.hidden_physics import INTECO
from support.paths import CONFIG

from pendulum_rl_env import evaluate, train
from pendulum_rl_env.control.classical import Classical, Tuning, make_plant
from pendulum_rl_env.control.design import run_controller
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.learning import cloning
from pendulum_rl_env.learning.cloning import LOG_STD, Demonstrations, clone, demonstrate
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.learning.history_vec_env import HistoryVecEnv
from pendulum_rl_env.learning.learner import make_learner
from pendulum_rl_env.learning.policies import load_controller
from pendulum_rl_env.learning.preset import IN_PROCESS, load_preset
from pendulum_rl_env.task import Task
from pendulum_twin.encoders import EXACT
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TASK = Task()
LATE = Twin("late", INTECO.rig, {"input_delay": {"delay_s": 0.04}})


@pytest.fixture
def few(monkeypatch) -> None:
    monkeypatch.setattr(cloning, "EPISODES", 2)
    monkeypatch.setattr(cloning, "EPOCHS", 3)


def test_demonstrations_hold_what_the_expert_wanted_and_earned(few, monkeypatch) -> None:
    monkeypatch.setattr(cloning, "NOISE_SHARE", 0.0)
    monkeypatch.setattr(cloning, "ASIDE_RAD", 0.0)
    shown = demonstrate([INTECO], TASK, EXACT, history=1, gamma=0.99, seed=0)
    controller = Classical(make_plant(INTECO, TASK), Tuning())
    reward = run_controller(KernelTransport(INTECO, TASK.step_s), controller, TASK)
    assert shown.rewards == pytest.approx([reward, reward])
    assert shown.observations.shape == (1024, 11) and np.abs(shown.actions).max() <= 1.0
    # the action that an observation remembers is the action before it
    assert shown.observations[1:512, 10] == pytest.approx(shown.actions[:511, 0], abs=1e-6)
    assert shown.returns[511] == pytest.approx(100.0, rel=0.05)  # upright for ever: 1 / (1 - 0.99)


def test_an_expert_that_is_disturbed_knows_what_was_held(few) -> None:
    """With a delay its regulator counts past drives: those that were held."""
    shown = demonstrate([LATE], TASK, EXACT, history=0, gamma=0.99, seed=1)
    assert shown.rewards.max() > 400


def test_a_twin_that_cannot_be_balanced_demonstrates_nothing(few) -> None:
    stiff = Twin("stiff", INTECO.rig, {"pole_spring": {"n_m_per_rad": 0.5}})
    with pytest.raises(BadInputError, match="expected a pole that falls"):
        demonstrate([stiff], TASK, EXACT, history=0, gamma=0.99, seed=0)
    assert len(demonstrate([stiff, INTECO], TASK, EXACT, 0, 0.99, 0).rewards) == 2


def test_cloning_copies_commands_and_values(monkeypatch) -> None:
    monkeypatch.setattr(cloning, "EPOCHS", 30)
    random = np.random.default_rng(0)
    observations = random.uniform(-1, 1, (2000, 11)).astype(np.float32)
    known = Demonstrations(
        observations, 0.5 * observations[:, [1]], 50 + 10 * observations[:, 0], np.zeros(1)
    )
    preset = load_preset("taught", IN_PROCESS)
    model = make_learner(preset, HistoryVecEnv(FleetVecEnv(Fleet([INTECO], 32)), 1), 0, None)
    assert clone(model, known, 0) < 0.05
    action = model.predict(observations[:5], deterministic=True)[0]
    assert action == pytest.approx(known.actions[:5], abs=0.1)
    values = model.policy.predict_values(model.policy.obs_to_tensor(observations)[0])
    assert np.corrcoef(values.detach().numpy()[:, 0], known.returns)[0, 1] > 0.95
    assert float(model.policy.log_std.detach()[0]) == pytest.approx(LOG_STD)


def test_the_preset_trains_and_its_policy_is_used_with_its_history(few, tmp_path, capsys) -> None:
    twin, out = str(CONFIG / "inteco.yaml"), tmp_path / "run"
    command = ["--twin", twin, "--preset", "taught", "--out", str(out), "--until", "-100"]
    assert train.main(command) == 0
    assert "2 demonstrations of the classical controller" in capsys.readouterr().err
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert [row["steps"] for row in result["evaluations"]] == [0]
    policy = ["--policy", str(out / "policy.zip"), "--twin", twin, "--episodes", "1", "--json"]
    assert evaluate.main(policy) == 0
    mean = json.loads(capsys.readouterr().out)["mean_reward"]
    assert mean == pytest.approx(result["best_mean_reward"], abs=0.5)
    controller = load_controller(out / "policy.zip", TASK)
    for _ in range(2):  # a second episode remembers nothing of the first
        reward = run_controller(KernelTransport(INTECO, TASK.step_s), controller, TASK)
        assert reward == pytest.approx(mean, abs=0.5)
    again = [*command[:5], str(tmp_path / "onnx"), "--onnx", "--until", "-100"]
    assert train.main(again) == 1
    assert "expected a policy for observations (5,)" in capsys.readouterr().err


@pytest.mark.parametrize(
    "more", [["--rig", "rig"], ["--env", "pendulum_rl_env/SamplePendulum-v0"]]
)
def test_demonstrations_need_a_twin(more: list[str], tmp_path: Path, capsys, few) -> None:
    assert train.main(["--preset", "taught", "--out", str(tmp_path / "run"), *more]) == 1
    assert "expected" in capsys.readouterr().err
