"""Which effects might explain what a fit leaves: rank the catalogue by one linearised step each.

Every candidate is tried at a typical size; how far to go along it is solved for together with
everything that is fitted already (a score test; Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50).
Where a candidate has many possible starts (a period, a place on the rail) the force that the
smoothed motion lacks picks the best few first.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.finding.angle_scan import balancing_ratio
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.linearised import System, linearised
from pendulum_sysid.fitting.parameters import Free, free_parameters, size_of
from pendulum_sysid.fitting.windows import shorter
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME, CATALOGUE, angle_scale
from pendulum_twin.effects.effect import Effect, Form, Place
from pendulum_twin.inverse_dynamics import compute_missing_force, evaluate_laws
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values

MANY_PROBES = 8  # more starts than this are thinned out by the missing force first
KEPT_PROBES = 3
LARGEST = 10.0  # times a typical size
STARTS = 3
SEARCHED_FORMS = (
    Form.FILTER,
    Form.FORCE,
    Form.DRY,
    Form.DRY_RATIO,
    Form.MEASURE,
)  # those that motion shows


@dataclass(frozen=True)
class Proposal:
    """Hold one candidate: the set of effects with it, the words from which a fit should start, and the gain it promises.

    effect: the new one; effects that it contains as special cases have left the set. theta:
    (starts, SIZE), several for an effect with a place, a period or a limit. gain: of the log
    likelihood on the training windows, to first order.
    """

    effect: str
    effects: tuple[str, ...]
    theta: Floats
    gain: float


def propose(case: Case, split: Split, fit: Fit) -> list[Proposal]:
    """Return every effect that the rig can have and the fit does not hold yet, the most promising first."""
    probed = [
        (effect, theta)
        for effect in candidates(case, fit.effects)
        for theta in probes(case, fit, effect)
    ]
    free = free_parameters(case.twin, fit.effects, case.scales)
    problem = case.problem(shorter(case.state, split.train, fit.parts))
    system = linearised(
        problem, fit.theta, fit.starts, free, fit.power, np.array([theta for _, theta in probed])
    )
    promised = [
        _promise(system, len(free) + k, fit, free, effect, theta)
        for k, (effect, theta) in enumerate(probed)
    ]
    ranked = sorted(promised, key=lambda one: -one.gain)
    return [
        _joined([one for one in ranked if one.effect == name])
        for name in dict.fromkeys(o.effect for o in ranked)
    ]


def _joined(same: list[Proposal]) -> Proposal:
    """Return proposals of one effect, the best first, as one with several starts."""
    shaped = any(parameter.shape for parameter in BY_NAME[same[0].effect].parameters)
    kept = same[: STARTS if shaped else 1]
    return replace(same[0], theta=np.concatenate([one.theta for one in kept]))


def _promise(
    system: System, column: int, fit: Fit, free: tuple[Free, ...], effect: Effect, theta: Floats
) -> Proposal:
    """Return how far along a probe to go, everything fitted already following, and what that gains (a score test)."""
    held = slice(0, len(free))
    follow = np.linalg.lstsq(system.normal[held, held], system.normal[held, column], rcond=1e-12)[
        0
    ]
    own = max(float(system.normal[column, column] - system.normal[column, held] @ follow), 1e-300)
    slope = float(system.gradient[column] - system.gradient[held] @ follow)
    sizes = [p for p in effect.parameters if not p.shape]
    least = 0.0 if not sizes or any(p.low >= 0.0 for p in sizes) else -LARGEST
    far = float(np.clip(slope / own, least, LARGEST if sizes else 1.0))
    start = theta.copy()
    for k, parameter in enumerate(effect.parameters):
        word = SLOTS[effect.name].start + k
        if not parameter.shape:
            reached = parameter.neutral + far * (theta[word] - parameter.neutral)
            start[word] = np.clip(reached, parameter.low, parameter.high)
    for one, change in zip(free, -follow * far, strict=True):
        one.put(start, float(np.clip(one.get(fit.theta) + change * one.size, one.low, one.high)))
    if replaced(effect, fit.effects) or effect is angle_scale.EFFECT:
        start = theta
    return Proposal(
        effect.name,
        with_effect(effect, fit.effects),
        start[None],
        far * slope - 0.5 * far**2 * own,
    )


def replaced(effect: Effect, held: tuple[str, ...]) -> tuple[str, ...]:
    """Return which of the held effects a candidate contains as special cases."""
    return tuple(name for name in held if name in effect.simpler)


def with_effect(effect: Effect, held: tuple[str, ...]) -> tuple[str, ...]:
    """Return the set of effects with a candidate in it, in place of those that it contains."""
    return (*(name for name in held if name not in effect.simpler), effect.name)


def candidates(case: Case, held: tuple[str, ...]) -> list[Effect]:
    """Return the effects that make sense on this rig beside those already held."""
    dry = any(
        BY_NAME[name].form is Form.DRY and BY_NAME[name].place is Place.CART for name in held
    )
    return [
        e
        for e in CATALOGUE
        if e.searched
        and e.parameters
        and e.form in SEARCHED_FORMS
        and e.shows_as is None
        and _makes_sense(case, e)
        and e.name not in held
        and not any(e.name in BY_NAME[name].simpler for name in held)
        and (e.form is not Form.DRY_RATIO or dry)
    ]


def _makes_sense(case: Case, effect: Effect) -> bool:
    """Return whether a rig with these joints can show the effect."""
    rig = case.twin.rig
    if (
        effect.name == "position_scale"
    ):  # a cart alone fits any scale: nothing of it is known in metres
        return rig.has_cart and rig.has_pole
    if any(p.located for p in effect.parameters) and not case.angle_steps:
        return False
    return rig.has_pole if effect.place in (Place.POLE, Place.SENSOR) else rig.has_cart


def probes(case: Case, fit: Fit, effect: Effect) -> list[Floats]:
    """Return the fit's words with the candidate's typical sizes put in, thinned out when there are many."""
    found = []
    for one in _typical(case, fit, effect):
        theta = fit.theta.copy()
        theta[SLOTS[effect.name]] = one
        for name in replaced(effect, fit.effects):
            hand_over(theta, BY_NAME[name], effect)
        found.append(theta)
    if len(found) <= MANY_PROBES or effect.place not in (Place.CART, Place.POLE):
        return found
    return _thinned(case, fit, effect, found)


def _typical(case: Case, fit: Fit, effect: Effect) -> list[tuple[float, ...]]:
    """Return the sizes from which to start; those of a slip and of a wrong scale are read off the recording."""
    if any(p.located for p in effect.parameters):
        return [(step.angle_rad, step.time_s) for step in case.angle_steps]
    if effect is angle_scale.EFFECT:
        return [(balancing_ratio(case, fit.theta) or effect.parameters[0].probes[0],)]
    sizes = [size_of(p, case.scales) for p in effect.parameters]
    combinations = itertools.product(*(p.probes for p in effect.parameters))
    return [tuple(a * b for a, b in zip(one, sizes, strict=True)) for one in combinations]


def hand_over(theta: Floats, old: Effect, new: Effect) -> None:
    """Take an effect out of words and give its values to the parameters of the same name of another."""
    kept = {p.name: theta[SLOTS[old.name].start + k] for k, p in enumerate(old.parameters)}
    theta[SLOTS[old.name]] = get_neutral_values(old)
    for k, parameter in enumerate(new.parameters):
        if parameter.name in kept:
            theta[SLOTS[new.name].start + k] = kept[parameter.name]


def _thinned(case: Case, fit: Fit, effect: Effect, found: list[Floats]) -> list[Floats]:
    """Return the starts whose law looks most like the missing force along the smoothed motion, unlike one another."""
    column = 0 if effect.place is Place.CART else 1
    lacking, usable = compute_missing_force(
        case.signals, case.state.states, case.state.accelerations, fit.theta
    )
    target = lacking[usable, column]
    shapes = []
    held = evaluate_laws(case.signals, case.state.states, fit.theta)
    for theta in found:
        shape = (evaluate_laws(case.signals, case.state.states, theta) - held)[usable, column]
        shapes.append(shape / max(float(np.linalg.norm(shape)), 1e-300))
    likeness = np.array([float(shape @ target) for shape in shapes])
    kept: list[int] = []
    for k in np.argsort(-likeness):
        if all(abs(float(shapes[k] @ shapes[other])) < 0.7 for other in kept):
            kept.append(int(k))
        if len(kept) == KEPT_PROBES:
            break
    return [found[k] for k in kept]
