"""A correction is added to a controller's command, within its bound."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.control.base import Base
from pendulum_rl_env.control.classical import Tuning
from pendulum_rl_env.control.design import run_controller
from pendulum_rl_env.correction import CorrectedEnv, Correction, Corrector
from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.in_process import make_twin_env
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.learning.corrected_vec_env import CorrectedVecEnv
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TASK = Task()
WEAK = Twin("weak", replace(INTECO.rig, pwm_limit=0.2))
CORRECTION = Correction(Base(INTECO, TASK.step_s, Tuning(), None), 0.4)
NOTHING = np.zeros(1, dtype=np.float32)


def test_no_correction_is_the_controller_itself() -> None:
    wanted = run_controller(
        KernelTransport(INTECO, TASK.step_s), CORRECTION.base.make_controllers(1)[0], TASK
    )
    env = gym.wrappers.TimeLimit(CorrectedEnv(make_twin_env(), CORRECTION), TASK.steps)
    for _ in range(2):  # a second episode remembers nothing of the first
        shown, _ = env.reset()
        total, is_over = 0.0, False
        while not is_over:
            assert env.observation_space.contains(shown)
            shown, reward, terminated, truncated, _ = env.step(NOTHING)
            total, is_over = total + reward, terminated or truncated
        assert total == pytest.approx(wanted, abs=0.01)
        assert shown[6] == 1.0 and shown[3] == pytest.approx(1.0, abs=0.01)  # balances, upright


def test_corrections_keep_to_their_bound_and_the_limit() -> None:
    def correct(action: float) -> float:
        corrector = Corrector(CORRECTION, 1)
        corrector.begin([0], np.array([[0.3, 0.1, 0.0, 0.0]]))
        return float(corrector.choose_commands([[action]])[0])

    own = correct(0.0)
    assert own != 0.0
    assert correct(0.1) == pytest.approx(own + 0.1 * 0.4 * 0.5)
    for action in (1.0, -7.0):
        wanted = own + np.clip(action, -1, 1) * 0.4 * 0.5
        assert correct(action) == pytest.approx(np.clip(wanted, -0.5, 0.5))


@pytest.mark.parametrize(("rig_limit", "most"), [(0.2, 0.2), (0.9, 0.5), (np.inf, 0.5)])
def test_corrected_commands_keep_to_the_smaller_limit(rig_limit: float, most: float) -> None:
    corrector = Corrector(replace(CORRECTION, bound=3.0), 1)
    corrector.heed_limit(rig_limit)
    assert [corrector.choose_commands([[a]])[0] for a in (1.0, -1.0)] == [most, -most]


def test_each_pendulum_has_a_controller_of_its_own() -> None:
    corrector = Corrector(CORRECTION, 2)
    states = np.array([[0.0, np.pi, 0.0, 0.0], [0.1, 0.2, 0.0, 0.0]])
    corrector.begin([0, 1], states)
    first = corrector.show()
    corrector.choose_commands(np.zeros(2))
    corrector.follow([0], states + 0.1)
    shown = corrector.show()
    assert np.array_equal(shown[1], first[1]) and not np.array_equal(shown[0], first[0])
    corrector.begin([0], states)
    assert np.array_equal(corrector.show(), first)


def test_another_sample_time_is_refused() -> None:
    with pytest.raises(BadInputError, match=r"expected commands 0\.03 s apart"):
        CorrectedEnv(make_twin_env(step_s=0.02), CORRECTION)


@pytest.mark.parametrize("designed_for", [WEAK, INTECO], ids=lambda twin: twin.name)
def test_the_observer_hears_of_the_commands_that_a_weaker_rig_takes(designed_for: Twin) -> None:
    """Told of others it runs away: the cart seemed to be metres from where it was."""
    correction = replace(CORRECTION, base=replace(CORRECTION.base, twin=designed_for))
    limit = correction.base.task.pwm_limit
    env = CorrectedEnv(make_twin_env(WEAK, pwm_limit=limit), correction)
    (controller,) = env._corrector._controllers
    env.reset(seed=1)
    for action in (1.0, 1.0, -1.0, -1.0, 0.5):
        _, _, _, _, info = env.step(np.array([action], dtype=np.float32))
        assert abs(info["applied_pwm"]) <= 0.2
        assert controller._past[-2] == pytest.approx(info["applied_pwm"], abs=1e-7)
        assert controller._classical.state == pytest.approx(info["state"], abs=1e-3)


def test_many_at_once_hear_of_them_too() -> None:
    fleet = FleetVecEnv(Fleet([WEAK], 2, TASK))
    env = CorrectedVecEnv(fleet, CORRECTION)
    env.reset()
    env.step(np.ones((2, 1), dtype=np.float32))
    assert [c._past[0] for c in env._corrector._controllers] == [0.2, 0.2]
    assert fleet.last_measured[0, 2] > 0.0


def test_a_fleet_of_another_task_gets_the_same_commands() -> None:
    """Training goes on in another twin: actions are scaled by the fleet's limit."""
    for task in (TASK, replace(TASK, pwm_limit=1.0)):
        fleet = FleetVecEnv(Fleet([INTECO], 1, task))
        env = CorrectedVecEnv(fleet, CORRECTION)
        env.reset()
        env.step(np.zeros((1, 1), dtype=np.float32))
        own = env._corrector._controllers[0]._past[0]
        wanted = KernelTransport(INTECO, TASK.step_s)
        wanted.reset()
        assert own != 0.0
        assert fleet.last_measured[0] == pytest.approx(wanted.exchange(own).state, abs=1e-6)
