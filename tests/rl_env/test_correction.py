"""A correction is added to a controller's command, within its bound."""

import gymnasium as gym
import numpy as np
import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.control.base import Base
from pendulum_rl_env.control.classical import Tuning
from pendulum_rl_env.control.design import run_controller
from pendulum_rl_env.correction import CorrectedEnv, Correction, Corrector
from pendulum_rl_env.in_process import make_twin_env
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError

TASK = Task()
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
