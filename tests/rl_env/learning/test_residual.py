"""The preset `residual`: a policy that corrects a controller, and is kept only when it helps."""

import json
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
from support.hidden_physics import INTECO
from support.paths import CONFIG

from pendulum_rl_env import evaluate, train
from pendulum_rl_env.control.base import Base
from pendulum_rl_env.control.classical import Tuning
from pendulum_rl_env.control.design import run_controller
from pendulum_rl_env.correction import Correction
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.learning.corrected_vec_env import CorrectedVecEnv
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.learning.policies import load_controller, load_policy
from pendulum_rl_env.learning.policy_file import FACTS
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TWIN = str(CONFIG / "inteco.yaml")
TASK = Task()
BASE = Base(INTECO, TASK.step_s, Tuning(), None)
WEAK = Twin("weak", INTECO.rig, {"gain_asymmetry": {"ratio": 0.05}})
SMALL = """
pendulum_rl_env/InvertedPendulum-v0:
  {algorithm: ppo, timesteps: 1024, environments: 8, correction: 1.5, episode_steps: 40,
   layers: [16], learning_rate: 0.1, evaluate_every: 512,
   settings: {n_steps: 64, batch_size: 128, n_epochs: 4}}
"""


@pytest.fixture(scope="module")
def training(tmp_path_factory) -> Path:
    """A training that ruins the controller: its steps are far too large."""
    out = tmp_path_factory.mktemp("training")
    (out / "small.yaml").write_text(SMALL, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(train, "design_base", lambda *_: BASE)
        arguments = ["--twin", TWIN, "--preset", str(out / "small.yaml"), "--quiet"]
        assert train.main([*arguments, "--out", str(out / "run")]) == 0
    return out / "run"


def test_many_pendulums_earn_what_their_controllers_earn() -> None:
    fleet = Fleet([INTECO, WEAK], 6, TASK, seed=3)
    env = CorrectedVecEnv(FleetVecEnv(fleet), Correction(BASE, 0.5), fixed_seed=3)
    known = [
        run_controller(KernelTransport(twin, TASK.step_s), BASE.make_controllers(1)[0], TASK)
        for twin in (INTECO, WEAK)
    ]
    assert abs(known[0] - known[1]) > 0.1
    for _ in range(2):  # the same twins at every reset
        first = env.reset()
        for _ in range(TASK.steps):
            shown, _, dones, infos = env.step(np.zeros((6, 1)))
        assert dones.all() and np.array_equal(shown, first)
        rewards = [info["episode"]["r"] for info in infos]
        assert sorted({round(r, 3) for r in rewards}) == pytest.approx(sorted(known), abs=1e-3)
        assert all(info["terminal_observation"][6] == 1.0 for info in infos)  # it balances


def test_rewards_are_less_what_is_deducted() -> None:
    envs = [
        CorrectedVecEnv(FleetVecEnv(Fleet([INTECO], 2)), Correction(BASE, 0.5), deduction)
        for deduction in (0.0, 1.0)
    ]
    rewards = [env.reset() is not None and env.step(np.zeros((2, 1)))[1] for env in envs]
    assert rewards[1] == pytest.approx(rewards[0] - 1.0)


def test_a_correction_that_does_not_help_is_not_kept(training: Path) -> None:
    result = json.loads((training / "result.json").read_text(encoding="utf-8"))
    steps = [row["steps"] for row in result["evaluations"]]
    rewards = [row["mean_reward"] for row in result["evaluations"]]
    assert steps == [0, 512, 1024] and min(rewards) < rewards[0] == result["best_mean_reward"]
    model = load_policy(training / "policy.zip")
    actions = [model.predict(np.full(8, s, np.float32), deterministic=True)[0] for s in (0, 1)]
    assert not np.any(actions)
    last = load_policy(training / "checkpoints" / "policy_1024_steps.zip")
    assert np.any(last.predict(np.ones(8, np.float32), deterministic=True)[0])


def test_a_policy_that_stands_alone_is_refused_before_a_controller_is_designed(
    training: Path, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    alone = tmp_path / "alone.yaml"
    alone.write_text(SMALL.replace("correction: 1.5, ", ""), encoding="utf-8")
    words = ["--twin", TWIN, "--quiet", "--out"]
    assert train.main([*words, str(tmp_path / "first"), "--preset", str(alone)]) == 0
    monkeypatch.setattr(train, "design_base", lambda *_: pytest.fail("designs a controller"))
    words = [*words, str(tmp_path / "second"), "--preset", str(training.parent / "small.yaml")]
    policy = tmp_path / "first" / "policy.zip"
    assert train.main([*words, "--init", str(policy)]) == 1
    expected = f"{policy}: expected a policy that corrects a controller"
    assert expected in capsys.readouterr().err


def test_its_file_is_evaluated_and_used_as_a_controller(training: Path, capsys) -> None:
    file = training / "policy.zip"
    assert evaluate.main(["--policy", str(file), "--twin", TWIN, "--episodes", "1", "--json"]) == 0
    mean = json.loads(capsys.readouterr().out)["mean_reward"]
    rig = KernelTransport(INTECO, TASK.step_s)
    controller = load_controller(file, TASK)
    wanted = run_controller(rig, BASE.make_controllers(1)[0], TASK)
    assert mean == pytest.approx(wanted, abs=0.01)
    for _ in range(2):
        assert run_controller(rig, controller, TASK) == pytest.approx(wanted)
    other = ["--policy", str(file), "--twin", TWIN, "--step-s", "0.02"]
    assert evaluate.main(other) == 1
    assert "expected commands 0.03 s apart" in capsys.readouterr().err


def test_it_goes_on_from_its_checkpoint_with_the_same_controller(
    training: Path, tmp_path: Path, monkeypatch
) -> None:
    def refuse(*_) -> Base:
        raise AssertionError("no controller is designed anew")

    monkeypatch.setattr(train, "design_base", refuse)
    small, out = training.parent / "small.yaml", training
    command = ["--twin", TWIN, "--preset", str(small), "--out", str(out), "--quiet", "--resume"]
    before = json.loads((out / "result.json").read_text(encoding="utf-8"))
    policy = (out / "policy.zip").read_bytes()
    assert train.main([*command, "--timesteps", "1536"]) == 0
    assert load_policy(out / "checkpoints" / "policy_1536_steps.zip").num_timesteps == 1536
    after = json.loads((out / "result.json").read_text(encoding="utf-8"))
    rows = after["evaluations"]
    assert rows[:3] == before["evaluations"] and [row["steps"] for row in rows[3:]] == [1536]
    assert (out / "policy.zip").read_bytes() == policy  # it was the best, and still is


@pytest.mark.parametrize(
    ("key", "value"), [("bound", 9.0), ("bound", float("nan")), ("base", {}), ("bound", "large")]
)
def test_a_damaged_controller_is_refused(
    training: Path, tmp_path: Path, key: str, value: object
) -> None:
    damaged = tmp_path / "policy.zip"
    with ZipFile(training / "policy.zip") as old, ZipFile(damaged, "w") as new:
        for name in old.namelist():
            content = old.read(name)
            if name == FACTS:
                facts = json.loads(content)
                facts["correction"][key] = value
                content = json.dumps(facts).encode()
            new.writestr(name, content)
    with pytest.raises(BadInputError, match="expected a policy that `train` has written"):
        load_policy(damaged)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (["--rig", "rig"], "expected a twin to design a controller for"),
        (["--env", "pendulum_rl_env/SamplePendulum-v0"], "expected settings under the key"),
        (["--onnx"], "expected no --onnx"),
    ],
)
def test_what_it_cannot_do_is_said_before_it_learns(
    more: list[str], said: str, tmp_path: Path, capsys
) -> None:
    assert train.main(["--preset", "residual", "--out", str(tmp_path / "run"), *more]) == 1
    assert said in capsys.readouterr().err
