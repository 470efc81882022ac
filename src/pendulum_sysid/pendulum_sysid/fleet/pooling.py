"""Pool estimates: of one rig from its recordings, and of a rig among its siblings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar
from scipy.stats import t as student

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats

COVERED = 0.95  # of intervals
REACH, STEPS = 3.0, 40  # of the grid of standard deviations: times what shows, and points


@dataclass(frozen=True)
class Pooled:
    """Hold a pooled size, in the unit of the estimates.

    Attributes:
        value: the mean over recordings.
        low, high: its 95 % interval.
        error: its standard error, without the widening for few recordings.
        spread: standard deviation of the true values from recording to recording.
        expected_low, expected_high: 95 % interval of the true value at the next recording.
        count: recordings.
    """

    value: float
    low: float
    high: float
    error: float
    spread: float
    expected_low: float
    expected_high: float
    count: int


def pool_estimates(values: Floats, errors: Floats) -> Pooled:
    """Return the random-effects mean of estimates (REML; interval of Hartung, Knapp and Sidik).

    values: (n,) estimates, n at least 1.
    errors: (n,) their standard errors.

    The interval takes Student's t for n - 1 and is never narrower than the standard errors allow
    (Knapp and Hartung 2003, with the factor at least 1).
    """
    n = len(values)
    spread = estimate_spread(values, errors)
    weights = 1.0 / (errors**2 + spread**2)
    total = float(weights.sum())
    mean = float(weights @ values) / total
    scatter = float(weights @ (values - mean) ** 2) / max(n - 1, 1)
    error = float(np.sqrt(max(scatter, 1.0) / total))
    deviations = decisions.INTERVAL_DEVIATIONS
    # a recording alone knows no scatter: its own interval stands
    half = error * (student.isf((1 - COVERED) / 2, n - 1) if n > 1 else deviations)
    ahead = float(np.hypot(spread, error))
    # two recordings know their scatter by one degree of freedom, as the mean does
    degrees = max(n - 2, 1)
    half_ahead = ahead * (student.isf((1 - COVERED) / 2, degrees) if n > 1 else 2 * deviations)
    return Pooled(
        mean, mean - half, mean + half, error, spread, mean - half_ahead, mean + half_ahead, n
    )


def estimate_spread(values: Floats, errors: Floats) -> float:
    """Return the standard deviation between recordings beyond the standard errors, by REML."""
    if len(values) < 2:
        return 0.0
    widest = float(np.ptp(values)) or float(np.max(errors))

    def compute_cost(spread: float) -> float:
        variances = errors**2 + spread**2
        weights = 1.0 / variances
        mean = weights @ values / weights.sum()
        return float(
            np.log(variances).sum() + np.log(weights.sum()) + weights @ (values - mean) ** 2
        )

    best = minimize_scalar(compute_cost, bounds=(0.0, widest), method="bounded")
    return float(best.x) if best.fun < compute_cost(0.0) else 0.0


@dataclass(frozen=True)
class Family:
    """Hold what rigs of one kind have in common, and each rig with what it borrows from them.

    Attributes:
        mean: over the rigs.
        low, high: 95 % interval of the mean.
        between: standard deviation from rig to rig.
        within: standard deviation from recording to recording of a rig.
        rigs: of each rig, its size with its interval, in the order given.
    """

    mean: float
    low: float
    high: float
    between: float
    within: float
    rigs: tuple[Pooled, ...]


def pool_family(groups: Sequence[tuple[Floats, Floats]]) -> Family:
    """Return the hierarchical mean of rigs: y = mean + rig + recording + error.

    groups: of each rig, at least 3, the estimates and their standard errors.

    Both standard deviations are averaged over with a flat prior (Gelman 2006), because a single
    best value, often 0, makes intervals too narrow: they held the truth in 85 % instead of 95 %.
    """
    alone = [pool_estimates(values, errors) for values, errors in groups]
    means = np.array([pooled.value for pooled in alone])
    widest_error = max(float(np.median([pooled.error for pooled in alone])), 1e-300)
    betweens = np.linspace(0.0, REACH * max(float(np.std(means)), widest_error), STEPS)
    withins = np.linspace(0.0, REACH * max(_measure_scatter(groups), widest_error), STEPS)
    grids = [_weigh(groups, within, betweens) for within in withins]
    costs = np.array([grid.costs for grid in grids])
    likely = np.exp(-0.5 * (costs - costs.min()))
    likely /= likely.sum()
    centre = np.array([grid.means for grid in grids])
    mean, error = _mix(likely, centre, np.array([grid.variances for grid in grids]))
    within = float((likely.sum(axis=1) @ withins**2) ** 0.5)
    rigs = []
    for r, pooled in enumerate(alone):
        values = np.array([grid.rig_means[:, r] for grid in grids])
        value, own = _mix(likely, values, np.array([g.rig_variances[:, r] for g in grids]))
        half = decisions.INTERVAL_DEVIATIONS * own
        ahead = decisions.INTERVAL_DEVIATIONS * float(np.hypot(own, within))
        ends = (value - half, value + half)
        rigs.append(Pooled(value, *ends, own, within, value - ahead, value + ahead, pooled.count))
    half = error * float(student.isf((1 - COVERED) / 2, max(len(groups) - 1, 1)))
    between = float((likely.sum(axis=0) @ betweens**2) ** 0.5)
    return Family(mean, mean - half, mean + half, between, within, tuple(rigs))


@dataclass(frozen=True)
class _Grid:
    """Hold, for each standard deviation between rigs: cost, mean, and what each rig becomes."""

    costs: Floats
    means: Floats
    variances: Floats
    rig_means: Floats
    rig_variances: Floats


def _weigh(groups: Sequence[tuple[Floats, Floats]], within: float, betweens: Floats) -> _Grid:
    weights, means, cost = [], [], 0.0
    for values, errors in groups:
        variances = errors**2 + within**2
        own = 1.0 / variances
        mean = own @ values / own.sum()
        weights.append(own.sum())
        means.append(mean)
        cost += float(np.log(variances).sum() + np.log(own.sum()) + own @ (values - mean) ** 2)
    precision, centre = np.array(weights), np.array(means)
    spread = betweens[:, None] ** 2 + 1.0 / precision
    trust = 1.0 / spread
    total = trust.sum(axis=1)
    common = (trust @ centre) / total
    costs = cost + np.log(spread).sum(axis=1) + np.log(total)
    costs += (trust * (centre - common[:, None]) ** 2).sum(axis=1)
    share = 1.0 / precision / spread  # of the common mean in a rig's size
    return _Grid(
        costs,
        common,
        1.0 / total,
        (1.0 - share) * centre + share * common[:, None],
        (1.0 - share) / precision + share**2 / total[:, None],
    )


def _mix(likely: Floats, means: Floats, variances: Floats) -> tuple[float, float]:
    """Return mean and standard deviation of a mixture."""
    mean = float((likely * means).sum())
    return mean, float(np.sqrt((likely * (variances + (means - mean) ** 2)).sum()))


def _measure_scatter(groups: Sequence[tuple[Floats, Floats]]) -> float:
    """Return the standard deviation of estimates about their rigs' means."""
    squares = [np.sum((values - values.mean()) ** 2) for values, _ in groups]
    return float(np.sqrt(sum(squares) / max(sum(len(v) - 1 for v, _ in groups), 1)))
