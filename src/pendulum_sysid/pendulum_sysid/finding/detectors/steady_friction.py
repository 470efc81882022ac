"""Find dry friction that holds the cart back everywhere, when something else is missing as well.

No fitted name can be believed when something is missing that no effect explains: the nearest
effect takes on whatever remains. The level of the dry friction can be measured without a fit of
effects, over each variable in turn, beside free curves of the force over command and position and
beside what explains the remaining force. Friction that is a part of some other law vanishes
somewhere: at the first second, on half of the rail, while the pole stands. Only friction that is
clearly there all over every variable is called certain. Laws that hold it as a special case, and
friction by load, are there all over, too: what is unexplained may be what they add.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.localisation.balance import FORCE
from pendulum_sysid.finding.localisation.explain import explain
from pendulum_sysid.finding.localisation.inspection import get_own_constants, make_table
from pendulum_sysid.finding.localisation.measured_curves import MeasuredCurve, measure_curves
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.records import Estimate
from pendulum_twin.effects import BY_NAME, CATALOGUE, cart_coulomb_friction, cart_load_friction
from pendulum_twin.effects.effect import Form, Place

EFFECT = cart_coulomb_friction.EFFECT
LOAD_FRICTION = cart_load_friction.EFFECT
PRODUCT = "cart_direction*"  # of the questions that measure the level along a variable
FRICTION_FORMS = (Form.DRY, Form.PATH_FORCE, Form.STATE_FRICTION)
BESIDE = ("command", "cart_position")  # curves of the force that may take their part first


def read_friction(sight: Sight) -> tuple[Reading, ...]:
    """Return the cart's dry friction where it is certain; none where the twin has such friction.

    The twin has parameters alone.
    """
    laws = [BY_NAME[name] for name in sight.case.twin.effects]
    if any(law.form in FRICTION_FORMS and law.place is Place.CART for law in laws):
        return ()
    level = measure_friction(sight)
    if level is None:
        return ()
    estimates = {EFFECT.parameters[0].name: level}
    alike = [other.name for other in CATALOGUE if EFFECT.name in other.simpler]
    if sight.case.signals.pole is not None:  # without a pole the load is constant
        alike.append(LOAD_FRICTION.name)
    return (Reading(EFFECT.name, (level.value,), estimates, inseparable_from=tuple(alike)),)


def measure_friction(sight: Sight) -> Estimate | None:
    """Return the level (N) of the dry friction that a twin lacks; None when it is in doubt.

    Its interval reaches from the lowest to the highest level that was well measured anywhere.
    """
    theta, balance = sight.theta, sight.force
    if balance is None:
        return None
    table = make_table(sight.thinned, sight.motion, balance, theta)
    beside = _choose_questions_beside(table)
    levels = []
    for key in (key for key in table.questions if key.startswith(PRODUCT)):
        if not _is_sure(table, key, beside):
            return None
        measured = measure_curves(table, (*beside, key), get_own_constants(FORCE, theta))
        levels += [curve for curve in measured if curve.question.key == key]
    return combine_levels(levels)


def _choose_questions_beside(table: Table) -> tuple[str, ...]:
    """Return the questions that may take their part of the force first.

    These are all that explain it but those about the velocity.
    """
    explaining = [
        key for key in explain(table) if "cart_velocity" not in table.questions[key].variable
    ]
    return tuple(dict.fromkeys([*explaining, *(key for key in BESIDE if key in table.questions)]))


def _is_sure(table: Table, key: str, beside: tuple[str, ...]) -> bool:
    """Return whether the friction surely takes away a part of what other questions leave.

    How large a part does not matter: on a real rig much else is missing, too.
    """
    return table.compute_lead((*beside, key), beside) >= decisions.EVIDENCE_STANDARD_ERRORS


def combine_levels(levels: list[MeasuredCurve]) -> Estimate | None:
    """Return the friction when no point of any curve lies surely below a part of its middle."""
    if len(levels) < decisions.STEADY_LEAST_CURVES:
        return None
    middles = np.array([float(np.median(curve.y)) for curve in levels])
    lowest = np.array([float(np.min(curve.y + curve.band)) for curve in levels])
    if np.any(middles <= 0.0) or np.any(lowest < decisions.STEADY_SHARE * middles):
        return None
    sharp = [
        (curve, at)
        for curve, middle in zip(levels, middles, strict=True)
        if (at := curve.band <= decisions.STEADY_SHARE * middle).any()
    ]
    low = [float(np.min((curve.y - curve.band)[at])) for curve, at in sharp]
    high = [float(np.max((curve.y + curve.band)[at])) for curve, at in sharp]
    if len(low) < decisions.STEADY_LEAST_CURVES or min(low) <= 0.0:
        return None
    return Estimate(float(np.median(middles)), min(low), max(high))


DETECTOR = Detector(EFFECT, Use.CERTAIN, read_friction)
