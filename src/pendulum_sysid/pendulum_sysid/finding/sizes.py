"""Settle the sizes that are told, where the twin that a search ends at is incomplete."""

from __future__ import annotations

from pendulum_sysid import decisions
from pendulum_sysid.finding.judge import compute_lead, judge_over_whole_windows
from pendulum_sysid.finding.replication import widen_by_blocks, widen_intervals
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.latent_force import fit_under_latent_force
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.records import Fit, Split


def settle_sizes(case: Case, split: Split, fit: Fit) -> Fit:
    """Return a fit with sizes and intervals that hold where more than noise remains.

    Free runs bend sizes until they stay near on this motion. Beside a latent force of the size
    that the remainder has, sizes come nearer to the truth and to those of the next recording
    (`docs/latent_force.md`). Where that fit runs worse over whole windows, it is not taken: the
    improved twin has to run, too. A fit at the noise stays as it is.
    """
    if fit.choose <= decisions.MISFIT_AT_NOISE or not decisions.SETTLE_SIZES:
        return widen_intervals(case, split, fit)
    if not list_free_parameters(case.twin, fit.effects, case.scales):
        return fit
    settled, system = fit_under_latent_force(case, split, fit)
    free, beside = (judge_over_whole_windows(case, split, each) for each in (fit, settled))
    if compute_lead(free, beside).ratio > 1.0:
        return widen_intervals(case, split, fit)
    return widen_by_blocks(case, settled, system)
