"""The predictive controller on its twin, with delay, and beside others in a table."""

import math

import numpy as np
import pytest
from support.hidden_physics import INTECO

pytest.importorskip("stable_baselines3")

from pendulum_rl_env.control import optimum
from pendulum_rl_env.control.design import run_controller
from pendulum_rl_env.control.predictive import design_predictive, leave_margins
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.studies import controllers as study
from pendulum_rl_env.task import Task
from pendulum_twin.model import Twin

TASK = Task(steps=160)  # 4.8 s: a swing-up, and 3 s upright
LATE = Twin("late", INTECO.rig, {"input_delay": {"delay_s": 0.04}})


def test_it_swings_up_in_spite_of_a_delay_and_holds_the_pole(monkeypatch) -> None:
    monkeypatch.setattr(optimum, "ROUNDS", 15)
    controller = design_predictive(LATE, TASK, starts=1)
    rig = KernelTransport(LATE, TASK.step_s)
    first = run_controller(rig, controller, TASK)
    assert first > 110
    state = rig.exchange(0.0).state
    assert abs(math.remainder(state[1], 2 * math.pi)) < 0.1 and abs(state[0]) < 0.05


def test_its_plan_leaves_drive_and_rail_for_what_is_not_known() -> None:
    task = leave_margins(TASK)
    assert task.pwm_limit < TASK.pwm_limit and task.x_limit_m < TASK.x_limit_m
    assert task.steps == TASK.steps


class Pushes:
    """A controller that pushes as it is told."""

    def __init__(self, twin: Twin, task: Task) -> None:
        self.push = 0.5

    def reset(self) -> None:
        pass

    def __call__(self, measured: np.ndarray) -> float:
        return self.push


def test_controllers_stand_beside_each_other(monkeypatch, capsys, tmp_path) -> None:
    monkeypatch.setitem(study.DESIGNS, "classical", Pushes)
    assert study.main(["--controllers", "classical", "--out", str(tmp_path / "rows.json")]) == 0
    said = capsys.readouterr().out
    assert "| classical | -" in said and (tmp_path / "rows.json").is_file()
    rows = [{"controller": "a", "rewards": [400.0, 300.0, 200.0], "design_s": 1.0}]
    rows[0] |= {"command_ms": 0.2, "slow_command_ms": 0.3}
    assert "| a | 400.0 | 80.0 % | 250.0, 200.0 |" in study.format_table(rows, 500.0)
    assert study.main(["--twin", "nowhere.yaml"]) == 1
