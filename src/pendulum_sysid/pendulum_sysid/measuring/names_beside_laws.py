"""Ask names again beside measured laws: which the twin needs, and which are parts of a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.effect_forces import EffectForces
from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.measuring.curve import LEVELS, PARTS, Curve
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.penalised_fit import fit_laws
from pendulum_sysid.measuring.ranking import add_by_one_step
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.laws.kind import LawKind
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


def list_sized(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names that the fit holds with a size, and might do without.

    A law of an effect's own kind could stand for anything, so such an effect is not among them:
    what the law adds says whether the effect is there (`list_bent`).
    """
    law_fit = measured.law_fit
    return [
        name
        for name in names
        if name in law_fit.fit.effects
        and not BY_NAME[name].is_switch
        and not any(is_of_kind(curve, name) for curve in law_fit.curves)
    ]


def list_needed(measured: Measured, sized: Sequence[str]) -> tuple[str, ...]:
    """Return the effects without which a fit with the same laws is worse on windows left out.

    sized: see `list_sized`.

    Laws take what had no name. An effect that they can stand for may have stood for that; an
    effect that they cannot stand for is there by itself.
    """
    law_fit, needed = measured.law_fit, []
    for name in sized:
        start = law_fit.fit
        theta = start.theta.copy()
        theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
        effects = tuple(effect for effect in start.effects if effect != name)
        less = fit_laws(
            measured.case,
            measured.split,
            replace(start, theta=theta, effects=effects),
            law_fit.curves,
            law_fit.priors,
            law_fit.inflation,
        )
        if compute_lead(start, less.fit).is_real:
            needed.append(name)
    return tuple(needed)


def list_lesser_parts(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names that are a part of a law and smaller than the rest of it.

    The error of a disc may have any shape. The first wave of that error (`Effect.law_parts`) is a
    name only where the wave is larger than the rest of the error. Where no law of that kind was
    measured, it is tried to first order.
    """
    law_fit, lesser = measured.law_fit, []
    for name in (name for name in names if BY_NAME[name].law_parts):
        kind = BY_NAME[name].law_kind
        alike = [curve for curve in law_fit.curves if curve.kind.name == kind]
        beside = (
            (alike[0], law_fit.fit.theta)
            if alike
            else add_by_one_step(measured.case, measured.split, law_fit, kind)
        )
        if beside is not None and _is_lesser_part(*beside, name):
            lesser.append(name)
    return lesser


def _is_lesser_part(curve: Curve, theta: Floats, name: str) -> bool:
    parts = np.array([PARTS[part](curve.knots) for part in BY_NAME[name].law_parts])
    own = np.average((theta[SLOTS[name]] @ parts) ** 2, weights=curve.visits)
    return bool(own < np.average(curve.get_values(theta) ** 2, weights=curve.visits))


def list_bent(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names whose shape a measured law bends.

    A law of an effect's kind holds every shape of the effect: what the law adds is what the shape
    is off, and its force may have SHAPE_TOLERANCE of the power of the effect's force. A law of dry
    friction varies the level that a friction has everywhere, by up to STEADY_SHARE of the level.
    """
    theta, bent = measured.law_fit.fit.theta, []
    beside = [
        (name, curve)
        for curve in measured.law_fit.curves
        for name in names
        if is_of_kind(curve, name) or _is_level(curve.kind, BY_NAME[name])
    ]
    if not beside:
        return []
    forces = EffectForces(measured.case, theta)
    for name, curve in beside:
        straight = theta.copy()
        curve.put(straight, np.zeros(len(curve.knots)))
        own, added = forces.compute(theta, [name])[0], forces.compute_share(theta, straight)
        of_kind = is_of_kind(curve, name)
        allowed = decisions.SHAPE_TOLERANCE if of_kind else decisions.STEADY_SHARE**2
        if added @ added > allowed * own @ own:
            bent.append(name)
    return bent


def is_of_kind(curve: Curve, name: str) -> bool:
    """Return whether a law could take the place of an effect: it holds every shape of it."""
    effect = BY_NAME[name]
    return effect.law_kind == curve.kind.name and not effect.law_parts


def _is_level(kind: LawKind, effect: Effect) -> bool:
    """Return whether a law varies a level of dry friction that an effect has everywhere."""
    everywhere = effect.form is Form.DRY and not effect.becomes
    return everywhere and kind.place is effect.place and _varies_level(kind)


def _varies_level(kind: LawKind) -> bool:
    return bool({(kind.role, None), (kind.role, kind.variable)} & set(LEVELS))


def is_part_of_law(measured: Measured, name: str) -> bool:
    """Return whether a measured law contains an effect, or leaves it a level of friction."""
    effect = BY_NAME[name]
    return any(
        curve.kind.name == effect.law_kind
        or (
            effect.form is Form.DRY
            and curve.kind.place is effect.place
            and _varies_level(curve.kind)
        )
        for curve in measured.law_fit.curves
    )
