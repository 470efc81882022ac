"""Widen the interval of an estimate, join the intervals of two fits, and limit steady sizes."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.parameters import Free, Scales, list_effect_parameters
from pendulum_sysid.records import Estimate, Fit
from pendulum_twin.effects import BY_NAME


def join_intervals(fit: Fit, other: Fit, names: Collection[str]) -> Fit:
    """Return a fit whose intervals of these parameters hold those of another fit, too.

    fit, other: of the same recordings.
    names: of parameters; those that the other fit lacks stay as they are.
    """
    joined = {
        name: replace(
            fit.estimates[name],
            low=min(fit.estimates[name].low, other.estimates[name].low),
            high=max(fit.estimates[name].high, other.estimates[name].high),
        )
        for name in names
        if name in fit.estimates and name in other.estimates
    }
    return replace(fit, estimates={**fit.estimates, **joined})


def limit_sizes(fit: Fit, own: Fit, names: Collection[str], scales: Scales) -> Fit:
    """Return a fit whose intervals of a steady effect's sizes are no wider than its steadiness.

    Every environment shows the effect within STEADY_SHARE of its size, all sizes of the effect
    together, each in its typical size. The intervals reach no further, unless the fit's own do.

    own: the same fit, before its intervals were joined.
    names: of the steady effects; an effect without a size stays as it is.
    scales: of the recording.
    """
    limited = {}
    for name in names:
        sizes = [
            free
            for free, p in zip(
                list_effect_parameters(BY_NAME[name], scales),
                BY_NAME[name].parameters,
                strict=True,
            )
            if not p.shape
        ]
        whole = np.linalg.norm([free.get(fit.theta) / free.size for free in sizes])
        for free in sizes:
            mine, joined = own.estimates[free.name], fit.estimates[free.name]
            half = (1.0 - decisions.STEADY_SHARE) * float(whole) * free.size
            limited[free.name] = replace(
                joined,
                low=max(joined.low, min(mine.low, mine.value - half)),
                high=min(joined.high, max(mine.high, mine.value + half)),
            )
    return replace(fit, estimates={**fit.estimates, **limited})


def widen_estimate(estimate: Estimate, free: Free, below: float, above: float) -> Estimate:
    """Return an estimate with an interval that reaches so far below and above its value."""
    low, high = max(estimate.value - below, free.low), min(estimate.value + above, free.high)
    fixed = estimate.identifiable and max(below, above) < max(abs(estimate.value), free.size)
    return replace(estimate, low=float(low), high=float(high), identifiable=bool(fixed))
