"""A planned swing-up with feedback: on its twin, on twins that are not quite it, and in a file."""

import json
from collections.abc import Callable

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are
from support.hidden_physics import INTECO

from pendulum_rl_env.control import planned
from pendulum_rl_env.control.base import Base, parse_base
from pendulum_rl_env.control.classical import Classical, Tuning, make_plant
from pendulum_rl_env.control.design import PERTURBATIONS, make_perturbed_rig, run_controller
from pendulum_rl_env.control.planned import STATE_WEIGHTS, Plan, Planned, compute_gains, make_plans
from pendulum_rl_env.control.rollouts import Slopes
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TASK = Task()
LATE = Twin("late", INTECO.rig, {"input_delay": {"delay_s": 0.04}})
PLAN = Plan(np.array([0.3, -0.2]), np.zeros((2, 4)), np.ones((2, 5)))


@pytest.fixture(scope="module")
def base() -> Base:
    return Base(LATE, TASK.step_s, Tuning(), make_plans(make_plant(LATE, TASK), 0.92)[0])


def test_gains_of_a_long_plan_are_those_of_the_algebraic_riccati_equation() -> None:
    """The drive remembers a command, as with a delay; the plan's begin is far from its end."""
    state = np.array([[1, 0, 0.03, 0], [0, 1.03, 0, 0.03], [0, 0, 0.9, 0], [0, 1.5, 0, 1.0]])
    now, before = np.array([0, 0, 0.2, -0.4]), np.array([0.01, -0.01, 0.1, -0.3])
    slopes = Slopes(np.tile(state, (400, 1, 1)), np.tile([now, before], (400, 1, 1)))
    a, b = np.zeros((5, 5)), np.append(now, 1.0)[:, None]
    a[:4, :4], a[:4, 4] = state, before
    p = solve_discrete_are(a, b, np.diag([*STATE_WEIGHTS, 0.0]), np.array([[0.3]]))
    wanted = -np.linalg.solve(0.3 + b.T @ p @ b, b.T @ p @ a)[0]
    assert compute_gains(slopes, 0.3)[0] == pytest.approx(wanted, rel=1e-3)


def test_a_plan_is_corrected_by_state_and_past_commands() -> None:
    assert PLAN.correct_command(0, np.zeros(4), []) == 0.3
    assert PLAN.correct_command(1, np.zeros(4), [0.3]) == -0.2
    away = np.array([0.1, 0.0, 0.0, 0.2])
    assert PLAN.correct_command(1, away, [0.4]) == pytest.approx(-0.2 + 0.3 + 0.1)


def test_it_earns_more_than_the_classical_controller_with_a_delay(base: Base) -> None:
    plain, better = Classical(make_plant(LATE, TASK), Tuning()), base.make_controllers(1)[0]
    for changes in PERTURBATIONS[:3]:
        rig = make_perturbed_rig(LATE, TASK, *changes)
        rewards = [run_controller(rig, c, TASK) for c in (plain, better, better)]
        assert rewards[1] > rewards[0] + 4 and rewards[2] == rewards[1]
        assert better.is_balancing and better.progress == 1.0


@pytest.mark.parametrize("turns", [-2, -1, 1])
def test_a_pole_may_hang_in_any_turn(base: Base, turns: int) -> None:
    """A rig's reset leaves the angle at which the pole has come to hang."""
    controller, aside_rad = base.make_controllers(1)[0], 2 * np.pi * turns
    rigs = [make_perturbed_rig(LATE, TASK, 1.0, 1.0, aside) for aside in (0.0, aside_rad)]
    first, other = (run_controller(rig, controller, TASK) for rig in rigs)
    assert other == pytest.approx(first, abs=0.5) and first > 440


def test_without_a_plan_it_is_the_classical_controller() -> None:
    rig, plant = make_perturbed_rig(INTECO, TASK, 1.0, 1.0, 0.0), make_plant(INTECO, TASK)
    controllers = Classical(plant, Tuning()), Planned(plant, Tuning(), None)
    rewards = [run_controller(rig, controller, TASK) for controller in controllers]
    assert rewards[0] == rewards[1]


def test_a_plan_that_does_not_get_the_pole_up_is_none(monkeypatch) -> None:
    monkeypatch.setattr(planned, "PLANNED_S", 0.3)
    assert make_plans(make_plant(INTECO, TASK)) == []


def test_the_best_on_twins_that_are_not_quite_it_is_designed(monkeypatch) -> None:
    """A plan of commands without feedback fails there, and the classical controller is left."""
    plant = make_plant(INTECO, TASK)
    blind = Plan(np.full(20, 0.5), np.zeros((20, 4)), np.zeros((20, 4)))
    monkeypatch.setattr(planned, "design_controller", lambda *_: Classical(plant, Tuning()))
    monkeypatch.setattr(planned, "make_plans", lambda *_: [blind])
    assert planned.design_planned(INTECO, TASK).plan is None


def test_a_file_holds_all_of_it(base: Base) -> None:
    again = parse_base(json.loads(json.dumps(base.to_mapping())))
    assert again.twin == LATE and again.tuning == base.tuning
    measured, controllers = np.array([0.1, 3.0, 0.2, 0.5]), [base, again]
    assert len({controller.make_controllers(1)[0](measured) for controller in controllers}) == 1
    plain = Base(INTECO, 0.02, Tuning(catch=2.0), None)
    assert parse_base(json.loads(json.dumps(plain.to_mapping()))) == plain


def _spoil(key: str, value: object) -> Callable[[dict], None]:
    return lambda mapping: mapping.__setitem__(key, value)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda m: m["tuning"].update(effort="3"),
        lambda m: m["tuning"].update(colour=1.0),
        lambda m: m["tuning"]["swing"].update(gain=float("nan")),
        lambda m: m["tuning"].update(weights=[1.0]),
        lambda m: m["plan"].update(commands=[]),
        lambda m: m["plan"]["gains"][0].pop(),
        lambda m: m["plan"]["states"][0].__setitem__(0, float("inf")),
        lambda m: m["plan"].update(gains=[[0.0] * 200] * len(m["plan"]["commands"])),
        lambda m: m.pop("plan"),
        _spoil("twin", {"name": "x"}),
        _spoil("step_s", True),
        _spoil("step_s", -1.0),
    ],
)
def test_what_is_no_controller_is_refused(base: Base, spoil: Callable[[dict], None]) -> None:
    mapping = json.loads(json.dumps(base.to_mapping()))
    spoil(mapping)
    with pytest.raises((BadInputError, KeyError, TypeError, ValueError)):
        parse_base(mapping)
