"""Gymnasium finds the environments in a fresh process, whatever has been imported."""

import subprocess
import sys
from importlib.metadata import EntryPoint

import gymnasium as gym
import pytest
from support.paths import SRC

import pendulum_rl_env
from pendulum_rl_env.registration import register_environments

IDS = ("InvertedPendulum-v0", "InvertedPendulumRos-v0", "SamplePendulum-v0")
PLAIN = "import gymnasium; print(gymnasium.make('{}').spec.id)"


def run(code: str) -> str:
    """Return what a fresh Python prints."""
    program = [sys.executable, "-c", code]
    return subprocess.run(program, check=True, capture_output=True, text=True).stdout.strip()


@pytest.mark.parametrize("name", ["InvertedPendulum-v0", "SamplePendulum-v0"])
def test_gymnasium_makes_an_environment_without_an_import(name: str) -> None:
    full = f"pendulum_rl_env/{name}"
    assert run(PLAIN.format(f"pendulum_rl_env:{full}")) == full


def test_the_entry_point_registers_all_ids_under_their_own_names() -> None:
    """Gymnasium before 1 loads it and calls it in no namespace (`__root__`)."""
    line = "pendulum_rl_env.registration:register_environments"
    assert f"__root__ = {{NAME}}.{line.removeprefix('pendulum_rl_env.')}" in (
        SRC / "pendulum_rl_env" / "setup.py"
    ).read_text(encoding="utf-8")
    load = EntryPoint("__root__", line, "gymnasium.envs").load()
    assert load is register_environments
    load()  # a second call does nothing
    assert all(f"pendulum_rl_env/{name}" in gym.registry for name in IDS)


def test_the_package_says_its_version() -> None:
    assert pendulum_rl_env.__version__ in (SRC / "pendulum_rl_env" / "package.xml").read_text(
        encoding="utf-8"
    )
