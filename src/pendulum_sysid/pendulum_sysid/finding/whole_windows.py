"""Misfits over windows of full length, which show what pieces of windows hide in the noise."""

from __future__ import annotations

from pendulum_sysid.finding.separation import drop_wild_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.records import Fit, Split, Windows


def measure_whole_windows(case: Case, split: Split, fit: Fit) -> tuple[float, float]:
    """Return the misfits of a fit over windows of full length: of those learned on, and held out.

    See `measure_fitted_starts`.
    """
    learned, held_out = (
        measure_fitted_starts(case, part, fit) for part in (split.learn, split.held_out)
    )
    return learned, held_out


def measure_fitted_starts(case: Case, windows: Windows, fit: Fit) -> float:
    """Return the misfit of a fit over windows of full length whose start states are fitted.

    Windows that magnify errors of their start are left out.
    """
    tame = drop_wild_windows(case.problem(windows), fit.theta, fit.power)
    return refine_start_states(tame, fit.theta).misfit(case.noise)
