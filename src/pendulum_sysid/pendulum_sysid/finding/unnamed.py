"""Widen intervals by physics that the search did not name.

A twin that leaves more than noise lacks something, and its constants and sizes have taken a share
of that. How large a share can be, the catalogue shows: every effect that the fit lacks acts
beside it with an unknown size, all of them with one prior deviation, under which the errors of
prediction are most likely (a discrepancy with a prior; Kennedy and O'Hagan, J. R. Stat. Soc. B 63
(2001) 425). What has none of their shapes is a latent force. An interval then holds the value of
the fit, and what the value becomes beside both. `docs/latent_force.md` counts how often such
intervals hold the truth.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from pendulum_sysid import decisions
from pendulum_sysid.finding.intervals import join_intervals, widen_estimate
from pendulum_sysid.finding.propose import list_probes
from pendulum_sysid.finding.replication import widen_intervals
from pendulum_sysid.finding.whole_windows import measure_whole_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import fit_over_horizon
from pendulum_sysid.fitting.latent_force import linearise_predictions, measure_latent_force
from pendulum_sysid.fitting.linearised import System
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.records import Estimate, Fit, Split
from pendulum_twin.arrays import Floats

LOG_VARIANCES = (-7.0, 16.0)  # ln of the prior variances that are tried
LEAST_ENERGY = 1e-9  # of a column; a smaller effect on the predictions shows nothing


@dataclass(frozen=True)
class Doubt:
    """Hold what unnamed effects may have done to the parameters of a fit, in their sizes.

    shifts: (parameters,) what the parameters become beside these effects, less what they are.
    deviations: (parameters,) standard deviations that these effects add.
    """

    shifts: Floats
    deviations: Floats


def widen_sizes(case: Case, split: Split, fit: Fit, alike: Collection[str] = ()) -> Fit:
    """Return a fit with intervals that stay valid where the errors exceed the noise.

    They cover the spread over blocks of time, and the share that missing effects may have added. A
    fit at the noise stays as it is, unless whole windows show errors that short pieces hide in the
    noise: then its intervals hold what a fit over whole windows makes of them.

    alike: effects that the recording cannot tell from those that are named. They are left out:
        the size of a name is the size that it has if the name is right.
    """
    if fit.pieces > 1 and fit.choose <= decisions.MISFIT_AT_NOISE:
        if measure_whole_windows(case, split, fit)[0] <= decisions.MISFIT_AT_NOISE:
            return fit
        whole = widen_sizes(case, split, fit_over_horizon(case, split, fit, 1), alike)
        return join_intervals(fit, whole, fit.estimates)
    widened = widen_intervals(case, split, fit)
    if fit.choose <= decisions.MISFIT_AT_NOISE or not decisions.DOUBT_BY_UNNAMED:
        return widened
    probes = [(e.name, theta) for e, theta in list_probes(case, fit) if e.name not in alike]
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    if not (free and probes):
        return widened
    latent = measure_latent_force(case, split, fit.theta)
    vectors = np.array([theta for _, theta in probes])
    system = linearise_predictions(case, split, fit, latent, vectors)
    doubt = compute_doubt(system, [name for name, _ in probes])
    estimates = {
        p.name: _widen(widened.estimates[p.name], p, shift, deviation)
        for p, shift, deviation in zip(free, doubt.shifts, doubt.deviations, strict=True)
    }
    return replace(widened, estimates={**widened.estimates, **estimates})


def compute_doubt(system: System, names: list[str]) -> Doubt:
    """Return what unnamed effects may have done to the parameters of a fit.

    system: the normal equations; the columns of the effects stand behind those of the parameters.
    names: of the effect of each of these columns; several columns share an effect's variance.
    """
    fitted = slice(0, len(system.normal) - len(names))
    others = slice(fitted.stop, None)
    counts = Counter(names)
    energies = np.diag(system.normal)[others]
    shares = np.array([counts[name] for name in names], dtype=float)
    units = np.where(energies > LEAST_ENERGY, 1.0, 0.0)
    units /= np.sqrt(np.maximum(energies, LEAST_ENERGY) * shares)
    scale = np.append(np.ones(fitted.stop), units)
    normal, gradient = system.normal * np.outer(scale, scale), system.gradient * scale
    inverse = np.linalg.pinv(normal[fitted, fitted])
    follow = inverse @ normal[fitted, others]
    left = normal[others, others] - normal[others, fitted] @ follow
    slope = gradient[others] - gradient[fitted] @ follow
    variance = _choose_variance(left, slope)
    spread = np.linalg.inv(left + np.eye(len(left)) / variance)
    sizes = spread @ slope
    shifts = inverse @ gradient[fitted] - follow @ sizes
    return Doubt(shifts, np.sqrt(np.einsum("pk,kl,pl->p", follow, spread, follow)))


def _choose_variance(left: Floats, slope: Floats) -> float:
    """Return the prior variance of the effects' sizes under which the errors are most likely.

    left, slope: (effects, effects), (effects,) normal equations of the effects, with the
        parameters of the fit following.
    """
    energies, ways = np.linalg.eigh(left)
    energies, along = np.maximum(energies, 0.0), (ways.T @ slope) ** 2

    def compute_cost(log_variance: float) -> float:
        variance = np.exp(log_variance)
        grown = 1.0 + variance * energies
        return 0.5 * float(np.sum(np.log(grown) - variance * along / grown))

    return float(np.exp(minimize_scalar(compute_cost, bounds=LOG_VARIANCES, method="bounded").x))


def _widen(estimate: Estimate, free: Free, shift: float, deviation: float) -> Estimate:
    """Return an estimate whose interval holds its value before and after a shift, in sizes."""
    more, moved = decisions.INTERVAL_DEVIATIONS * deviation * free.size, shift * free.size
    below = np.hypot(estimate.value - estimate.low, more) + max(-moved, 0.0)
    above = np.hypot(estimate.high - estimate.value, more) + max(moved, 0.0)
    return widen_estimate(estimate, free, below, above)
