"""A value of a law acts only in runs that come near its knot: the other runs need not be made."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.linearised import assemble, linearise
from pendulum_sysid.fitting.neighbours import run_neighbours
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.measuring.curve import Curve, list_curves
from pendulum_sysid.measuring.penalised_fit import list_all_free
from pendulum_sysid.prepare import prepare
from pendulum_twin.laws.kind import Variable
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

RIG = Twin("rig", INTECO.rig, {"cart_coulomb_friction": {"level_n": 0.3}})


@pytest.fixture(scope="module")
def prepared():
    return prepare([made(RIG, 30.0, amplitude=0.25)], RIG)


def list_kinds(case) -> dict[str, Curve]:
    curves = list_curves(case, make_theta(case.twin), tuple(case.twin.effects))
    return {curve.kind.name: curve for curve in curves}


def test_the_system_is_that_of_all_runs(prepared) -> None:
    case, split = prepared.case, prepared.split
    shares = {}
    for name, curve in list_kinds(case).items():
        theta = make_theta(case.twin)
        curve.put(theta, curve.size * 0.2 * np.cos(np.arange(len(curve.knots))))
        sparse = list_all_free(case, tuple(case.twin.effects), theta, (curve,))
        full = tuple(replace(parameter, acts=None) for parameter in sparse)
        problem = case.problem(shorten_windows(case.state, split.learn, 4))
        starts = problem.windows.start_states
        power = np.array([1e-7, 1e-6])
        some, every = (linearise(problem, theta, starts, free, power) for free in (sparse, full))
        size = np.sqrt(np.outer(np.diag(every.normal), np.diag(every.normal))) + 1e-9
        assert np.max(np.abs(some.normal - every.normal) / size) < 1e-6, name
        # which runs were left out: those without any derivative
        shares[curve.kind.variable] = float(np.mean(some.normals[:, -1, -1] == 0.0))
    assert shares[Variable.TIME] > 0.5 and shares[Variable.POSITION] > 0.2


def test_equations_of_runs_made_apart_are_those_of_all_together(prepared) -> None:
    """A law that is still 0 everywhere changes no bit of the other runs."""
    case, split = prepared.case, prepared.split
    problem = case.problem(shorten_windows(case.state, split.learn, 4))
    starts, power = problem.windows.start_states, np.array([1e-7, 1e-6])
    plain, effects = make_theta(case.twin), tuple(case.twin.effects)
    own = list_all_free(case, effects, plain, ())
    known = run_neighbours(problem, plain, starts, own, power)
    for name, curve in list_kinds(case).items():
        theta = plain.copy()
        curve.put(theta, np.zeros(len(curve.knots)))
        free = list_all_free(case, effects, theta, (curve,))
        together = linearise(problem, theta, starts, free, power)
        added = run_neighbours(problem, theta, starts, free[len(own) :], power)
        apart = assemble(problem, starts, known, added)
        for array in ("normals", "scores", "start_normal", "start_gradient", "cross", "pulls"):
            assert np.array_equal(getattr(apart, array), getattr(together, array)), (name, array)


def test_a_command_and_a_way_act_on_after_they_have_passed(prepared) -> None:
    curves = list_kinds(prepared.case).values()
    lasting = {Variable.COMMAND, Variable.WAY, Variable.TURN}
    assert {curve.kind.variable for curve in curves if curve.acts is None} == lasting
