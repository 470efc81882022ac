"""The examples run as they stand."""

import subprocess
import sys

import pytest
import yaml
from support.paths import ROOT


@pytest.mark.long
def test_ppo_on_the_vector_environment_gets_better() -> None:
    pytest.importorskip("torch")
    program = [sys.executable, str(ROOT / "examples" / "ppo_vector.py"), "--timesteps", "40960"]
    done = subprocess.run(program, check=True, capture_output=True, text=True)
    means = [line.split("mean reward ")[1].split(",")[0] for line in done.stdout.splitlines()]
    assert len(means) == 10 and float(means[-1]) > float(means[1]) + 10


def test_rl_zoo3_gets_the_settings_of_the_preset() -> None:
    pytest.importorskip("stable_baselines3")
    from pendulum_rl_env.learning.preset import load_preset

    file = ROOT / "examples" / "rl_zoo3.yml"
    for name, zoo in yaml.safe_load(file.read_text(encoding="utf-8")).items():
        fast = load_preset("fast", name)
        assert (fast.timesteps, fast.environments) == (zoo["n_timesteps"], zoo["n_envs"])
        assert fast.learning_rate == zoo["learning_rate"]
        assert {key: zoo[key] for key in fast.settings} == dict(fast.settings)
        assert zoo["policy_kwargs"] == f"dict(net_arch={list(fast.layers)})"
