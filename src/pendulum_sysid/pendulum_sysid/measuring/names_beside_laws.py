"""Ask names again beside measured laws: which the twin needs, and which are parts of a law."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.effect_forces import EffectForces
from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.measuring.curve import LEVELS, PARTS, Curve
from pendulum_sysid.measuring.further_law import fit_longer
from pendulum_sysid.measuring.halves import is_seen_in_halves
from pendulum_sysid.measuring.law_bands import widen_bands
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.penalised_fit import LawFit, fit_laws
from pendulum_sysid.measuring.ranking import step_to_curves
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.laws.kind import LawKind, Variable
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


def leave_out_names(measured: Measured, sized: Sequence[str]) -> dict[str, LawFit]:
    """Return the fit with the same laws without each effect, by the effect's name.

    sized: see `list_sized`.
    """
    law_fit, without = measured.law_fit, {}
    for name in sized:
        start = law_fit.fit
        theta = start.theta.copy()
        theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
        without[name] = fit_laws(
            measured.case,
            measured.split,
            replace(start, theta=theta, effects=tuple(e for e in start.effects if e != name)),
            law_fit.curves,
            law_fit.priors,
            law_fit.inflation,
        )
    return without


def list_needed(measured: Measured, without: Mapping[str, LawFit]) -> tuple[str, ...]:
    """Return the effects without which a fit with the same laws is worse on windows left out.

    without: fits without each effect, see `leave_out_names`.

    Laws take what had no name. An effect that they can stand for may have stood for that; an
    effect that they cannot stand for is there by itself.
    """
    fit = measured.law_fit.fit
    return tuple(name for name, less in without.items() if compute_lead(fit, less.fit).is_real)


def list_stand_ins(measured: Measured, without: Mapping[str, LawFit]) -> list[str]:
    """Return the effects that stand for a law that was not measured.

    A cause keeps its size when a law is added that helps; a stand-in gives way by more than a
    fifth of its force (`SHAPE_TOLERANCE` of its power). A cause keeps its shape beside a law of
    its own kind; a stand-in is bent (`list_bent`), if that law is the likeliest: any other law of
    its kind may follow what the likeliest explains. All laws are tried to first order; a law to
    which an effect would yield is fitted, and has to help on windows left out and in both halves,
    as every law. A part that effect and law share stays with the effect, which has no prior.
    Curves over time follow whatever is left, so no effect gives way to them. An effect beside
    which little is left cannot yield.

    without: fits without each effect, see `leave_out_names`.
    """
    case, split, law_fit = measured.case, measured.split, measured.law_fit
    theta, stand_ins = law_fit.fit.theta, set[str]()
    doubtful = {name for name, less in without.items() if _is_much_left(law_fit.fit, less.fit)}
    if not doubtful:
        return []
    forces = EffectForces(case, theta)
    for rank, (candidate, stepped) in enumerate(step_to_curves(case, split, law_fit)):
        curve = candidate.curve
        yielding = [
            name
            for name in sorted(doubtful - stand_ins)
            if not (rank and _may_bend(curve, name))
            and _yields(forces, curve, name, theta, stepped)
        ]
        if not yielding:
            continue
        try:
            longer = fit_longer(case, split, law_fit, candidate)
        except np.linalg.LinAlgError:
            continue
        leads = longer.lead is not None and longer.lead.is_real
        if leads and is_seen_in_halves(case, split, longer, law_fit):
            curve, after = longer.curves[-1], longer.fit.theta
            stand_ins |= {name for name in yielding if _yields(forces, curve, name, theta, after)}
    return sorted(stand_ins)


def _yields(forces: EffectForces, curve: Curve, name: str, before: Floats, after: Floats) -> bool:
    """Return whether a law bends an effect, or takes its size.

    before, after: theta (SIZE,) without the law and with it.
    """
    if _may_bend(curve, name):
        return _is_bent(forces, curve, name, after)
    timed = curve.kind.variable is Variable.TIME
    return not timed and _gives_way(forces, name, before, after)


def _is_much_left(fit: Fit, without: Fit) -> bool:
    """Return whether a fit leaves more than SHAPE_TOLERANCE of the power that an effect takes.

    without: the fit without the effect.
    """
    taken = without.choose**2 - fit.choose**2
    return fit.choose**2 > decisions.SHAPE_TOLERANCE * taken


def _gives_way(forces: EffectForces, name: str, theta: Floats, other: Floats) -> bool:
    """Return whether an effect's force is less in another twin; thetas (SIZE,) of both."""
    changed = theta.copy()
    changed[SLOTS[name]] = other[SLOTS[name]]
    before, after = (forces.compute(values, [name])[0] for values in (theta, changed))
    least = 1.0 - np.sqrt(decisions.SHAPE_TOLERANCE)
    return bool(before @ after < least * before @ before)


def list_lesser_parts(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names that are a part of a law and smaller than the rest of it.

    The error of a disc may have any shape. The first wave of that error (`Effect.law_parts`) is a
    name only where the wave is larger than the rest of the error. A scale is a name only where the
    rest varies the scale in no third of the rail by more than STEADY_SHARE of the scale.
    """
    theta = measured.law_fit.fit.theta
    return [
        name
        for curve in measured.law_fit.curves
        for name in names
        if BY_NAME[name].law_parts
        and BY_NAME[name].law_kind == curve.kind.name
        and _is_lesser_part(curve, BY_NAME[name].law_parts, theta[SLOTS[name]], theta)
    ]


def _is_lesser_part(curve: Curve, parts: Sequence[str], sizes: Floats, theta: Floats) -> bool:
    """Return whether parts of so many sizes are small beside the law's values in theta (SIZE,)."""
    own = sizes @ np.array([PARTS[part](curve.knots) for part in parts])
    rest = curve.get_values(theta)
    if "slope" not in parts:
        return _measure_power(curve, rest) > _measure_power(curve, own)
    own, rest = (np.abs(_measure_slopes(curve, values)) for values in (own, rest))
    return bool(np.any(rest > decisions.STEADY_SHARE * own))


def _measure_slopes(curve: Curve, values: Floats) -> Floats:
    """Return the slope of values (knots,) over each third of the places, as visited, (thirds,).

    A short wave varies no scale.
    """
    slopes, visits = [], np.maximum(curve.visits, 1.0)
    for third in np.array_split(np.arange(len(values)), decisions.REPLICATION_PARTS):
        around = curve.knots[third] - np.average(curve.knots[third], weights=visits[third])
        weighted = visits[third] * around
        slopes.append(weighted @ values[third] / (weighted @ around))
    return np.array(slopes)


def _measure_power(curve: Curve, values: Floats) -> float:
    """Return the mean square of values (knots,) over the places that were visited."""
    return float(np.average(values**2, weights=curve.visits))


def list_bent(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names whose shape a measured law bends.

    A law of an effect's kind holds every shape of the effect: what the law adds is what the shape
    is off, and its force may have SHAPE_TOLERANCE of the power of the effect's force. A law of dry
    friction varies the level that a friction has everywhere, by up to STEADY_SHARE of the level.
    The level is there whatever the law may be, so only what the law surely adds counts: its values
    as far as they lie beyond their band.
    """
    beside = [
        (name, law)
        for law in widen_bands(measured)
        for name in names
        if _may_bend(law.curve, name)
    ]
    if not beside:
        return []
    theta = measured.named[0].theta
    forces, bent = EffectForces(measured.case, theta), []
    for name, law in beside:
        sure = theta.copy()
        if not is_of_kind(law.curve, name):
            law.curve.put(sure, _shrink(law.values, law.band))
        if _is_bent(forces, law.curve, name, sure):
            bent.append(name)
    return bent


def _shrink(values: Floats, band: Floats) -> Floats:
    """Return values (knots,) moved to 0 by their band (knots,), and not beyond."""
    return np.sign(values) * np.maximum(np.abs(values) - band, 0.0)


def _may_bend(curve: Curve, name: str) -> bool:
    return is_of_kind(curve, name) or _is_level(curve.kind, BY_NAME[name])


def _is_bent(forces: EffectForces, curve: Curve, name: str, theta: Floats) -> bool:
    """Return whether a law that theta (SIZE,) holds adds too much to an effect's force."""
    straight = theta.copy()
    curve.put(straight, np.zeros(len(curve.knots)))
    own, added = forces.compute(theta, [name])[0], forces.compute_share(theta, straight)
    allowed = decisions.SHAPE_TOLERANCE if is_of_kind(curve, name) else decisions.STEADY_SHARE**2
    return bool(added @ added > allowed * own @ own)


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
