"""Rank the effects of the catalogue by how well each might explain what a fit leaves.

Every candidate is tried at a typical size. The step along it that lowers the cost most is solved
for together with everything that is fitted already (score test; Rao, Proc. Cambridge Phil. Soc. 44
(1948) 50). Where a candidate has many possible starts (a period, a place on the rail), the force
that the smoothed motion lacks picks the best few first.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.detectors import find_start_detector
from pendulum_sysid.finding.detectors.detector import Sight
from pendulum_sysid.finding.separation import find_stand_in
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.linearised import System, linearise
from pendulum_sysid.fitting.parameters import (
    Free,
    compute_size,
    list_free_parameters,
    list_rig_parameters,
)
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Effect, Form, Place
from pendulum_twin.inverse_dynamics import compute_missing_force, evaluate_laws
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values

# The forms of effects that the motion shows.
SEARCHED_FORMS = (
    Form.FILTER,
    Form.GAIN,
    Form.DRIVE,
    Form.FORCE,
    Form.TIMED_FORCE,
    Form.DRY,
    Form.TIMED_FRICTION,
    Form.TIMED_MASS,
    Form.STATE_FRICTION,
    Form.PATH_FORCE,
    Form.DRY_RATIO,
    Form.MEASURE,
    Form.CLOCK,
    Form.LATE,
    Form.LAGGING,
)

SHAPE_SAMPLES = 3000  # that shapes of laws are compared at: a minute at 100 Hz has twice as many


@dataclass(frozen=True)
class Proposal:
    """Hold one candidate.

    effect: name of the new effect.
    effects: the set with it; effects that it contains as special cases have left the set.
    theta: (starts, SIZE) parameter vectors from which fits start; several for an effect with a
        place, a period or a limit.
    gain: of the log likelihood on the learning windows, to first order.
    """

    effect: str
    effects: tuple[str, ...]
    theta: Floats
    gain: float


def propose(
    case: Case, split: Split, fit: Fit, effects: Sequence[Effect] | None = None
) -> list[Proposal]:
    """Return every effect that the rig can have and the fit lacks, the most promising first.

    effects: the candidates; None for all.
    """
    probed = list_probes(case, fit, effects)
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    vectors = np.array([theta for _, theta in probed]).reshape(-1, fit.theta.size)
    system = linearise(problem, fit.theta, fit.start_states, free, fit.power, vectors, summed=True)
    own, whole = system.normal[: len(free), : len(free)], system.normal[: len(free), len(free) :]
    follow = np.linalg.lstsq(own, whole, rcond=1e-12)[0]
    promised = [
        _make_proposal(system, follow[:, k], len(free) + k, fit, free, effect, theta)
        for k, (effect, theta) in enumerate(probed)
    ]
    ranked = sorted(promised, key=lambda proposal: -proposal.gain)
    names = dict.fromkeys(proposal.effect for proposal in ranked)
    return [_join([p for p in ranked if p.effect == name]) for name in names]


def list_probes(
    case: Case, fit: Fit, effects: Sequence[Effect] | None = None
) -> list[tuple[Effect, Floats]]:
    """Return every candidate with theta (SIZE,) at each of its typical sizes.

    effects: the candidates; None for all.
    """
    sight = Sight(case, fit.theta)
    return [
        (effect, theta)
        for effect in (list_candidates(case, fit.effects) if effects is None else effects)
        for theta in make_probes(sight, fit, effect)
    ]


def _join(proposals: Sequence[Proposal]) -> Proposal:
    """Return proposals of one effect, the best first, as one proposal with several starts."""
    best = proposals[0]
    shaped = any(parameter.shape for parameter in BY_NAME[best.effect].parameters)
    kept = proposals[: decisions.STARTS_REFITTED if shaped else 1]
    return replace(best, theta=np.concatenate([proposal.theta for proposal in kept]))


def _make_proposal(
    system: System,
    follow: Floats,
    column: int,
    fit: Fit,
    free: tuple[Free, ...],
    effect: Effect,
    theta: Floats,
) -> Proposal:
    """Return the step along a probe that lowers the cost most, and the cost that the step saves.

    All fitted parameters follow (score test). What was read off the recording, and what has taken
    the place of a simpler effect, stays where it is.

    follow: (free parameters,) how far they follow the probe, in their sizes, with minus sign.
    column: of the probe in the system.
    theta: (SIZE,) of the probe.
    """
    fitted = slice(0, len(free))
    normal, gradient = system.normal, system.gradient
    own = max(float(normal[column, column] - normal[column, fitted] @ follow), 1e-300)
    slope = float(gradient[column] - gradient[fitted] @ follow)
    step = float(np.clip(slope / own, find_least_step(effect), find_largest_step(effect)))
    gain = step * slope - 0.5 * step**2 * own
    start = theta.copy()
    if _may_move(effect, fit.effects):
        _move(start, effect, step)
        for parameter, change in zip(free, -follow * step, strict=True):
            value = parameter.get(fit.theta) + change * parameter.size
            parameter.put(start, float(np.clip(value, parameter.low, parameter.high)))
    # A share of a period is the period of another resonance. So a fit starts at the probe, too: of
    # a period of 0.076 s the fit from 0.027 s leaves 24 times the noise, from 0.06 s 11 times.
    is_resonant = any(parameter.resonant for parameter in effect.parameters)
    starts = np.array([start, theta] if is_resonant else [start])
    return Proposal(effect.name, put_effect(effect, fit.effects), starts, gain)


def find_least_step(effect: Effect) -> float:
    """Return how far a fit may go along a probe's opposite: not at all where sizes have a sign."""
    is_one_way = not effect.sizes or any(p.low >= 0.0 for p in effect.sizes)
    return 0.0 if is_one_way else -decisions.LARGEST_STEP


def find_largest_step(effect: Effect) -> float:
    """Return how far a fit may go along a probe: to its end where it has shapes alone.

    A step does not move a shape, so that no run is that of a longer step.
    """
    return decisions.LARGEST_STEP if effect.sizes else 1.0


def _may_move(effect: Effect, known: Sequence[str]) -> bool:
    """Return whether a step may scale an effect's probe: not in the place of a known effect."""
    return not list_replaced(effect, known) and not effect.read_off


def _move(theta: Floats, effect: Effect, step: float) -> None:
    """Scale an effect's sizes in theta (SIZE,) by a step from where it vanishes, within bounds."""
    for slot, parameter in enumerate(effect.parameters, SLOTS[effect.name].start):
        if not parameter.shape:
            value = parameter.neutral + step * (theta[slot] - parameter.neutral)
            theta[slot] = np.clip(value, parameter.low, parameter.high)


def move_along(
    theta: Floats, effect: Effect, target: Floats, step: float, known: Sequence[str]
) -> None:
    """Give theta (SIZE,) an effect as a probe has it, its sizes scaled by a step.

    target: (SIZE,) parameter vector of the probe.
    known: effects that theta holds; those that the effect contains leave theta.
    """
    theta[SLOTS[effect.name]] = target[SLOTS[effect.name]]
    for name in list_replaced(effect, known):
        theta[SLOTS[name]] = target[SLOTS[name]]
    if _may_move(effect, known):
        _move(theta, effect, step)


def list_replaced(effect: Effect, known: Sequence[str]) -> tuple[str, ...]:
    """Return which of the held effects a candidate contains as special cases."""
    return tuple(name for name in known if name in effect.simpler)


def put_effect(effect: Effect, known: Sequence[str]) -> tuple[str, ...]:
    """Return the held effects with a candidate in the place of those that it contains."""
    return (*(name for name in known if name not in effect.simpler), effect.name)


def list_candidates(case: Case, known: Sequence[str]) -> list[Effect]:
    """Return the effects that make sense on this rig beside those already held."""
    laws = [BY_NAME[name] for name in known]
    constants = list_rig_parameters(case.twin)
    return [
        effect
        for effect in CATALOGUE
        if effect.searched
        and effect.parameters
        and effect.form in SEARCHED_FORMS
        and find_stand_in(effect, constants) is None
        and _can_be_seen(case, effect)
        and effect.name not in known
        and not any(effect.name in law.simpler for law in laws)
        and (effect.acts_beside is None or _has_kin(laws, BY_NAME[effect.acts_beside]))
    ]


def _has_kin(laws: Sequence[Effect], law: Effect) -> bool:
    """Return whether a law, or another of its form and place, is among some."""
    return any(other.form is law.form and other.place is law.place for other in laws)


def _can_be_seen(case: Case, effect: Effect) -> bool:
    """Return whether a rig with these joints can show the effect."""
    rig = case.twin.rig
    if effect.needs_both_joints:
        return rig.has_cart and rig.has_pole
    return rig.has_pole if effect.place in (Place.POLE, Place.SENSOR) else rig.has_cart


def make_probes(sight: Sight, fit: Fit, effect: Effect) -> list[Floats]:
    """Return theta (SIZE,) of a fit with the candidate's typical sizes, thinned out if many."""
    probes = []
    for values in _list_typical_values(sight, effect):
        theta = fit.theta.copy()
        theta[SLOTS[effect.name]] = values
        for name in list_replaced(effect, fit.effects):
            hand_over(theta, BY_NAME[name], effect)
        probes.append(theta)
    few = len(probes) <= decisions.PROBES_UNTHINNED
    if few or effect.place not in (Place.CART, Place.POLE):
        return probes
    return _thin_out(sight.case, fit, effect, probes)


def _list_typical_values(sight: Sight, effect: Effect) -> list[tuple[float, ...]]:
    """Return the values of its parameters from which an effect's fits start."""
    detector = find_start_detector(effect)
    if detector is not None:
        return [reading.values for reading in detector.read(sight)]
    sizes = [compute_size(parameter, sight.case.scales) for parameter in effect.parameters]
    combinations = itertools.product(*(parameter.probes for parameter in effect.parameters))
    return [tuple(a * b for a, b in zip(c, sizes, strict=True)) for c in combinations]


def hand_over(theta: Floats, old: Effect, new: Effect) -> None:
    """Take an effect out of theta (SIZE,) and give another its values of the same names."""
    values = {p.name: theta[SLOTS[old.name].start + k] for k, p in enumerate(old.parameters)}
    theta[SLOTS[old.name]] = get_neutral_values(old)
    for k, parameter in enumerate(new.parameters):
        if parameter.name in values:
            theta[SLOTS[new.name].start + k] = values[parameter.name]


def _thin_out(case: Case, fit: Fit, effect: Effect, probes: Sequence[Floats]) -> list[Floats]:
    """Return the probes whose laws look most like the missing force, and unlike one another.

    The missing force is that along the smoothed motion, without any fit.
    """
    signals, state = case.signals, case.state
    column = 0 if effect.place is Place.CART else 1
    lacking, usable = compute_missing_force(signals, state.states, state.accelerations, fit.theta)
    compared = np.flatnonzero(usable)
    compared = compared[:: max(len(compared) // SHAPE_SAMPLES, 1)]
    known = evaluate_laws(signals, state.states, fit.theta, compared)
    shapes = np.empty((len(probes), len(compared)))
    for shape, theta in zip(shapes, probes, strict=True):
        law = evaluate_laws(signals, state.states, theta, compared) - known
        shape[:] = law[:, column]
        shape /= max(float(np.linalg.norm(shape)), 1e-300)
    likeness = shapes @ lacking[compared, column]
    kept: list[int] = []
    for k in np.argsort(-likeness):
        if np.max(np.abs(shapes[kept] @ shapes[k]), initial=0.0) < decisions.ALIKE_PROBES:
            kept.append(int(k))
        if len(kept) == decisions.PROBES_KEPT:
            break
    return [probes[k] for k in kept]
