"""Whether an effect is no more than how the pole's encoder rounds.

A counter tells between which two counts the angle lies. It may round down or to the nearest
count, and its zero stands anywhere within the count in which the pole was when counting began. So
all readings may be off by a constant of up to half a step. The mean over a recording shows such a
constant many times finer than a step, and no motion tells rounding from a wrong zero: so small a
constant is no physics that a twin lacks.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pendulum_sysid.finding.naming import Named
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.sensors import apply_sensors

CONSTANT = "angle_offset"


def doubt_rounding(case: Case, fit: Fit, named: Iterable[Named]) -> tuple[Named, ...]:
    """Return the names with `is_rounding`: whether each is no more than how counts are rounded.

    fit: with intervals; the size nearest to 0 counts.
    """
    named, half_step = tuple(named), 0.5 * case.recording.pole_step_rad
    if not half_step:
        return named
    constants = [e for e in named if CONSTANT in (e.effect, *e.inseparable_from)]
    return tuple(
        replace(e, is_rounding=True)
        if e in constants and _measure_least_error(case, fit, e.effect) <= half_step
        else e
        for e in named
    )


def _measure_least_error(case: Case, fit: Fit, name: str) -> float:
    """Return by how much an effect of the angle's sensor moves readings (rms, rad), at least.

    Infinite for an effect that moves no reading, or has several sizes.
    """
    effect = BY_NAME[name]
    if effect.place is not Place.SENSOR or len(effect.parameters) != 1:
        return np.inf
    estimate = fit.estimates[f"{name}.{effect.parameters[0].name}"]
    least = max(estimate.low, min(estimate.high, 0.0))
    theta = make_theta(replace(case.twin, effects={}, measured_laws={}))
    theta[SLOTS[name]] = least
    states, t = case.state.states[None], case.signals.clock_s[None]
    moved = apply_sensors(states, theta[None], t)[0, :, 1] - case.state.states[:, 1]
    return float(np.sqrt(np.mean(moved**2)))
