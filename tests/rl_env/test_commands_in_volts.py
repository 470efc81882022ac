"""A rig whose command is in volts learns with all of its volts, as a rig with a PWM fraction."""

from dataclasses import replace
from types import SimpleNamespace

import gymnasium as gym
import numpy as np
import pytest

import pendulum_rl_env  # noqa: F401
from pendulum_rl_env import in_process
from pendulum_rl_env.control.base import Base, parse_base
from pendulum_rl_env.control.classical import Tuning
from pendulum_rl_env.learning import environments
from pendulum_rl_env.learning.preset import IN_PROCESS, load_preset
from pendulum_rl_env.task import Task
from pendulum_twin.encoders import EXACT
from pendulum_twin.inteco import INTECO
from pendulum_twin.model import Twin

VOLTS = 20.0  # as much force as at INTECO's PWM of 0.5
RIG = INTECO.rig
IN_VOLTS = Twin(
    "in_volts",
    replace(RIG, force_per_pwm_n=RIG.force_per_pwm_n * RIG.pwm_limit / VOLTS, pwm_limit=VOLTS),
)
ACTIONS = np.random.default_rng(3).uniform(-1, 1, (40, 1)).astype(np.float32)


@pytest.mark.parametrize(
    ("limit", "expected"), [(None, 0.5), (0.3, 0.3), (0.5, 0.5), (1.0, 0.5), (VOLTS, VOLTS)]
)
def test_a_smaller_limit_narrows_the_task_and_one_that_is_no_fraction_widens_it(
    limit: float | None, expected: float
) -> None:
    assert Task().allow_commands(replace(RIG, pwm_limit=limit)).pwm_limit == expected


def test_the_same_actions_move_a_rig_in_volts_alike() -> None:
    runs = []
    for twin in (INTECO, IN_VOLTS):
        env = gym.make("pendulum_rl_env/InvertedPendulum-v0", twin=twin)
        env.reset(seed=1)
        runs.append(np.array([env.step(action)[0] for action in ACTIONS]))
    assert np.ptp(runs[0][:, 0]) > 0.01
    assert runs[1] == pytest.approx(runs[0], abs=1e-5)


def test_many_in_one_call_get_the_same_task(monkeypatch: pytest.MonkeyPatch) -> None:
    tasks = []
    monkeypatch.setattr(in_process, "Fleet", lambda twins, count, task, *_: tasks.append(task))
    monkeypatch.setattr(in_process, "PendulumVectorEnv", lambda fleet: fleet)
    monkeypatch.setattr(environments, "Fleet", lambda twins, count, task, *_: tasks.append(task))
    monkeypatch.setattr(environments, "FleetVecEnv", lambda fleet: fleet)
    known = SimpleNamespace(twins=[IN_VOLTS], encoders=EXACT)
    monkeypatch.setattr(environments, "gather_training_knowledge", lambda options: known)
    in_process.make_twin_vector_env(2, IN_VOLTS)
    options = SimpleNamespace(rig=None, env=IN_PROCESS, step_s=0.03, seed=0)
    environments.make_environments(options, load_preset("fast", IN_PROCESS))
    assert [task.pwm_limit for task in tasks] == [VOLTS] * 3  # to step, to learn, to evaluate


def test_a_base_controller_keeps_the_unit() -> None:
    base = Base(IN_VOLTS, 0.03, Tuning(), None)
    assert base.task == Task().allow_commands(IN_VOLTS.rig)
    assert parse_base(base.to_mapping()).task.pwm_limit == VOLTS
