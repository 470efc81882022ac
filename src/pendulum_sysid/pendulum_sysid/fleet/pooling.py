"""Pool estimates: of one rig from its recordings, and of a rig among its siblings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize, minimize_scalar
from scipy.stats import t as student

from pendulum_twin.arrays import Floats

COVERED = 0.95  # of intervals


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
    # a recording alone knows no scatter: its own interval stands
    half = error * (student.isf((1 - COVERED) / 2, n - 1) if n > 1 else 1.96)
    ahead = float(np.hypot(spread, error))
    half_ahead = ahead * (student.isf((1 - COVERED) / 2, n - 2) if n > 2 else 1.96 * 2)
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
    """Return the hierarchical mean of rigs: y = mean + rig + recording + error, by REML.

    groups: of each rig, the estimates and their standard errors.
    """
    first = [pool_estimates(values, errors) for values, errors in groups]
    everything = np.concatenate([values for values, _ in groups])
    scale = float(np.std(everything)) or float(np.median(np.concatenate([e for _, e in groups])))
    begin = [
        max(float(np.std([p.value for p in first])), 1e-3 * scale) / scale,
        max(float(np.median([p.spread for p in first])), 1e-3 * scale) / scale,
    ]

    def compute_cost(logs: Floats) -> float:
        between, within = scale * np.exp(logs)
        weights, means, cost = _summarise(groups, within)
        variances = between**2 + 1.0 / weights
        trust = 1.0 / variances
        mean = trust @ means / trust.sum()
        cost += np.log(variances).sum() + np.log(trust.sum()) + trust @ (means - mean) ** 2
        return float(cost)

    solution = minimize(compute_cost, np.log(begin), method="L-BFGS-B", bounds=[(-12.0, 3.0)] * 2)
    between, within = (float(scale * x) for x in np.exp(solution.x))
    weights, means, _ = _summarise(groups, within)
    trust = 1.0 / (between**2 + 1.0 / weights)
    mean, error = float(trust @ means / trust.sum()), float(trust.sum() ** -0.5)
    quantile = float(student.isf((1 - COVERED) / 2, max(len(groups) - 1, 1)))
    rigs = tuple(
        _shrink(weights[r], means[r], between, mean, error, within, len(values), everything.size)
        for r, (values, _) in enumerate(groups)
    )
    return Family(mean, mean - quantile * error, mean + quantile * error, between, within, rigs)


def _summarise(
    groups: Sequence[tuple[Floats, Floats]], within: float
) -> tuple[Floats, Floats, float]:
    """Return each rig's weight and mean, and the cost of the recordings about these means."""
    weights, means, cost = [], [], 0.0
    for values, errors in groups:
        variances = errors**2 + within**2
        own = 1.0 / variances
        mean = own @ values / own.sum()
        weights.append(own.sum())
        means.append(mean)
        cost += np.log(variances).sum() + np.log(own.sum()) + own @ (values - mean) ** 2
    return np.array(weights), np.array(means), float(cost)


def _shrink(
    weight: float,
    own_mean: float,
    between: float,
    mean: float,
    mean_error: float,
    within: float,
    count: int,
    total: int,
) -> Pooled:
    """Return a rig's size, drawn towards the mean of all rigs as far as it is unsure itself."""
    prior = 1.0 / max(between, 1e-12 * abs(mean) + 1e-300) ** 2
    share = prior / (prior + weight)
    value = (1.0 - share) * own_mean + share * mean
    error = float(np.sqrt(1.0 / (prior + weight) + (share * mean_error) ** 2))
    quantile = float(student.isf((1 - COVERED) / 2, max(total - 2, 1)))
    ahead = float(np.hypot(error, within))
    return Pooled(
        value,
        value - quantile * error,
        value + quantile * error,
        error,
        within,
        value - quantile * ahead,
        value + quantile * ahead,
        count,
    )
