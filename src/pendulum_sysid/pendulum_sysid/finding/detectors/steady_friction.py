"""Whether dry friction holds the cart back everywhere, asked when something else is missing that no effect explains.

A name that a fit gives cannot be believed then: the nearest one takes on whatever is left. The
level of the dry friction can be measured without one, as it is over each variable in turn, beside
free curves of the force over command and position and beside what explains the rest. Friction that
is a part of some other law vanishes somewhere: at the first second, on half of the rail, while the
pole stands. Only friction that is clearly there all over every variable is called certain.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.localisation.balance import FORCE, along, balances
from pendulum_sysid.finding.localisation.explain import CERTAIN, explanation
from pendulum_sysid.finding.localisation.inspection import own_theta, table_of
from pendulum_sysid.finding.localisation.measured_curves import Curve, curves
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.finding.localisation.thinning import thinned
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Estimate
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.signals import Floats

EFFECT = "cart_coulomb_friction"
PRODUCT = "cart_direction*"  # of the questions that measure the level along a variable
BESIDE = ("command", "cart_position")  # curves of the force that may take their part first
STEADY = 0.5  # of the middle level, below which no part of a curve may surely lie
LEAST_PART = (
    0.3  # of what is missing beside these curves, for the friction to be a large part of it
)
CONFIDENCE = 0.99  # that there is such friction: it was surely there in every curve
LEAST_CURVES = 3  # of variables that move, to speak of everywhere


def steady_friction(case: Case, theta: Floats) -> Estimate | None:
    """Return the level (N) of the cart's dry friction, which a twin with these words lacks; None when it is in doubt.

    Its interval reaches from the lowest to the highest level that was well measured anywhere.
    """
    case = thinned(case)
    given = any(
        BY_NAME[name].form is Form.DRY and BY_NAME[name].place is Place.CART
        for name in case.twin.effects
    )
    found = [one for one in balances(case, theta) if one.equation == FORCE]
    if given or not found:
        return None
    table = table_of(case, along(case, theta), found[0], theta)
    beside = _beside(table)
    levels = []
    for key in (key for key in table.asked if key.startswith(PRODUCT)):
        if not _large(table, key, beside):
            return None
        levels += [
            one
            for one in curves(table, (*beside, key), own_theta(FORCE, theta))
            if one.question.key == key
        ]
    return _everywhere(levels)


def entry_of(level: Estimate) -> dict:
    """Return the verdict's entry of a friction (N) that is certain although something else has no name.

    The other laws of dry friction hold it as a special case: what is unexplained may be what they
    add.
    """
    effect = BY_NAME[EFFECT]
    parameter = effect.parameters[0]
    size = {"value": level.value, "low": level.low, "high": level.high, "unit": parameter.unit}
    return {
        "effect": EFFECT,
        "cannot_be_told_from": [one.name for one in CATALOGUE if EFFECT in one.simpler],
        "confidence": CONFIDENCE,
        "parameters": {parameter.name: size},
        "sentence": effect.sentence.format(level_n=f"{level.value:.3g} {parameter.unit}"),
    }


def _beside(table: Table) -> tuple[str, ...]:
    """Return the questions that may take their part of the force first: all that explain it but those about the velocity."""
    explaining = [
        key for key in explanation(table) if "cart_velocity" not in table.asked[key].variable
    ]
    return tuple(dict.fromkeys([*explaining, *(key for key in BESIDE if key in table.asked)]))


def _large(table: Table, key: str, beside: tuple[str, ...]) -> bool:
    """Return whether the friction takes away a large part of what the other questions leave, and surely so."""
    left = max(table.loss(beside) - table.balance.noise**2, 1e-300)
    return (
        table.gain(key, beside) >= LEAST_PART * left
        and table.lead((*beside, key), beside) >= CERTAIN
    )


def _everywhere(levels: list[Curve]) -> Estimate | None:
    """Return the friction when no point of any curve lies surely below a part of that curve's middle."""
    if len(levels) < LEAST_CURVES:
        return None
    middles = np.array([float(np.median(one.y)) for one in levels])
    lowest = [float(np.min(one.y + one.band)) for one in levels]
    if np.any(middles <= 0.0) or np.any(np.array(lowest) < STEADY * middles):
        return None
    sharp = [one.band <= STEADY * middle for one, middle in zip(levels, middles, strict=True)]
    low = [
        np.min((one.y - one.band)[at]) for one, at in zip(levels, sharp, strict=True) if at.any()
    ]
    high = [
        np.max((one.y + one.band)[at]) for one, at in zip(levels, sharp, strict=True) if at.any()
    ]
    if len(low) < LEAST_CURVES or min(low) <= 0.0:
        return None
    return Estimate(float(np.median(middles)), float(min(low)), float(max(high)))
