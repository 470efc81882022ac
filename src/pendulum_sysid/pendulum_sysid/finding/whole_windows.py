"""Misfits over windows of full length, which show what pieces of windows hide in the noise."""

from __future__ import annotations

from pendulum_sysid.finding.separation import drop_wild_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.records import Fit, Split
from pendulum_twin.parameter_vector import make_theta


def measure_whole_windows(
    case: Case, split: Split, fit: Fit
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the misfits of the given twin, and those of a fit, over windows of full length.

    Each are two: over the windows that were learned on, and over those that are held out. Start
    states are fitted. Windows that magnify errors of their start, as seen by the fit, are left out
    of all four.
    """
    problems = [
        drop_wild_windows(case.problem(part), fit.theta, fit.power)
        for part in (split.learn, split.held_out)
    ]
    (a, b), (c, d) = (
        [refine_start_states(problem, theta).misfit(case.noise) for problem in problems]
        for theta in (make_theta(case.twin), fit.theta)
    )
    return (a, b), (c, d)
