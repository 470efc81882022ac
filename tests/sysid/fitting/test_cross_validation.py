"""A window's cross-validated error is that of a fit to the other windows."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden
from support.made_recordings import made

from pendulum_sysid import decisions
from pendulum_sysid.fitting import cross_validation
from pendulum_sysid.fitting.cross_validation import cross_validate
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.gauss_newton import refine_start_states, solve
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.prepare import prepare
from pendulum_twin.parameter_vector import make_theta


def test_errors_are_those_of_a_fit_to_the_other_windows() -> None:
    recording = record_hidden({"input_delay": HIDDEN["input_delay"]}, 2, 20.0)[0]
    prepared = prepare([recording], INTECO)
    case, learn = prepared.case, prepared.split.learn
    free = list_free_parameters(case.twin, (), case.scales)
    problem = case.problem(learn)
    solution = solve(problem, make_theta(case.twin), free)
    left_out = cross_validate(problem, solution, free)
    fold = np.arange(len(learn)) % decisions.FOLDS
    refitted = np.empty_like(left_out)
    for k in range(decisions.FOLDS):
        others = solve(case.problem(learn.pick(fold != k)), solution.theta, free)
        own = refine_start_states(case.problem(learn.pick(fold == k)), others.theta)
        refitted[fold == k] = own.squares
    ratio = left_out.sum(axis=0) / refitted.sum(axis=0)
    assert np.all(np.abs(ratio - 1.0) < 0.3), ratio  # the step is that of a linear fit
    assert np.all(left_out.sum(axis=0) > solution.squares.sum(axis=0))


def test_a_constant_that_no_other_window_fixes_costs_its_window() -> None:
    """The command saturates in one fold only: the others know nothing of the limit."""
    prepared = prepare([made(INTECO, 12.0, 0.2)], INTECO)
    case, learn = prepared.case, prepared.split.learn
    problem = case.problem(learn)
    free = list_free_parameters(case.twin, ("input_saturation",), case.scales)
    theta = solve(problem, make_theta(case.twin), free[:5]).theta
    solution = solve(problem, theta, free)
    assert np.all(np.isfinite(cross_validate(problem, solution, free)))


def test_the_pieces_of_a_window_are_left_out_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """One piece of a window would tell most of what another is asked."""
    prepared = prepare([made(INTECO, 12.0, 0.2)], INTECO)
    case, pieces, left_out = prepared.case, 4, []
    problem = case.problem(shorten_windows(case.state, prepared.split.learn, pieces))
    free = list_free_parameters(case.twin, (), case.scales)
    solution = solve(problem, make_theta(case.twin), free)

    def keep(*about):
        left_out.append(about[3])
        return solution.theta, solution.start_states

    monkeypatch.setattr(cross_validation, "_step_without", keep)
    cross_validate(problem, solution, free, together=pieces)
    windows = np.array(left_out).reshape(decisions.FOLDS, -1, pieces)
    assert np.array_equal(windows.any(axis=2), windows.all(axis=2))
    assert np.all(windows.any(axis=2).sum(axis=0) == 1)  # each window once


def test_nothing_is_left_out_where_nothing_is_fitted() -> None:
    prepared = prepare([made(INTECO, 12.0, 0.2)], INTECO)
    problem = prepared.case.problem(prepared.split.learn)
    solution = solve(problem, make_theta(replace(INTECO)), ())
    assert cross_validate(problem, solution, ()) is solution.squares


@pytest.mark.parametrize("period_s", [0.03, 0.04])
def test_a_step_that_the_other_windows_lose_by_is_shortened(period_s: float) -> None:
    """A belt that stretches a little follows its period on no straight line."""
    belt = {"stretching_belt": {"period_s": period_s, "damping": 0.1, "motor_share": 0.15}}
    recording, truth = record_hidden(belt, 1, 30.0)
    prepared = prepare([recording], INTECO)
    fitted = fit(prepared.case, prepared.split, tuple(belt), make_theta(truth), HORIZONS[0])
    assert fitted.train < 1.0 and fitted.choose < 1.05 * fitted.train
