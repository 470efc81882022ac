"""Misfits over windows of full length, which show what pieces of windows hide in the noise."""

from __future__ import annotations

from pendulum_sysid.finding.separation import drop_wild_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.records import Fit, Split


def measure_whole_windows(case: Case, split: Split, fit: Fit) -> tuple[float, float]:
    """Return the misfits of a fit over windows of full length: of those learned on, and held out.

    Start states are fitted. Windows that magnify errors of their start are left out.
    """
    learned, held_out = (
        refine_start_states(
            drop_wild_windows(case.problem(part), fit.theta, fit.power), fit.theta
        ).misfit(case.noise)
        for part in (split.learn, split.held_out)
    )
    return learned, held_out
