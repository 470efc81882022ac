"""A law to be measured: its kind, knots over what the recording visited, and free values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.encoder_steps import find_shaft_turn
from pendulum_sysid.finding.detectors.steady_friction import FRICTION_FORMS
from pendulum_sysid.finding.localisation.balance import Motion, compute_motion
from pendulum_sysid.fitting.case import OF_CART, Case
from pendulum_sysid.fitting.parameters import Free, list_rig_parameters
from pendulum_sysid.measuring.fading_motion import is_fading
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.effects import BY_NAME as EFFECTS
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.laws import KINDS
from pendulum_twin.laws.kind import LIMITS, SCALES, LawKind, Role, Variable
from pendulum_twin.laws.law import (
    LEAST_WAY,
    MOST_LAWS,
    Law,
    compute_turn,
    locate_on_knots,
    spread_knots,
    spread_turn,
)
from pendulum_twin.parameter_vector import LAW_SIZE, LAWS, VALUES, put_law

# Knots to either side of a place whose values a run there may feel: two make the curve, and a run
# strays by less than a third from what was recorded.
REACH = 3
LEAST_GAIN = -0.9  # a drive keeps a tenth of its force wherever it is

PARTS: dict[str, Callable[[Floats], Floats]] = {  # parts of a curve, drawn over its knots
    "mean": np.ones_like,
    "slope": np.asarray,
    "step": np.sign,
    "size": np.abs,
    "sine": np.sin,
    "cosine": np.cos,
}
# The parts of a law that a constant of the rig stands for.
CONSTANTS: dict[tuple[Role, Variable | None], tuple[str, str]] = {  # None: whatever the variable
    (Role.GAIN, None): ("force_per_pwm_n", "mean"),
    (Role.COMMAND, None): ("force_per_pwm_n", "slope"),
    (Role.CART_DRAG, None): ("cart_viscous_n_s_m", "mean"),
    (Role.POLE_DRAG, None): ("pole_viscous_n_m_s", "mean"),
    (Role.FORCE, Variable.VELOCITY): ("cart_viscous_n_s_m", "slope"),
    (Role.TORQUE, Variable.RATE): ("pole_viscous_n_m_s", "slope"),
    (Role.CART_DRY, Variable.VELOCITY): ("cart_viscous_n_s_m", "size"),
    (Role.POLE_DRY, Variable.RATE): ("pole_viscous_n_m_s", "size"),
}
# The parts of a law that always stand for something else: the mean pace is `sample_period_error`,
# and the mean error along the rail says where the rail's 0 is.
NAMED: dict[tuple[Role, Variable | None], str] = {
    (Role.PACE, None): "mean",
    (Role.POSITION_ERROR, Variable.POSITION): "mean",
}
DRY = (Role.CART_DRY, Role.POLE_DRY)
LEVEL_FORMS = (Form.DRY, Form.STATE_FRICTION)  # of effects that are a level of dry friction
# The parts of a law that the level of a dry friction stands for.
LEVELS: dict[tuple[Role, Variable | None], str] = {
    (Role.CART_DRY, None): "mean",
    (Role.POLE_DRY, None): "mean",
    (Role.FORCE, Variable.VELOCITY): "step",
    (Role.TORQUE, Variable.RATE): "step",
}


@dataclass(frozen=True)
class Curve:
    """Hold a law whose values are to be fitted.

    kind: of the law.
    knots: (k,) on an even grid over what was visited, in the unit of the kind's variable.
    seen: (n,) places that were visited, sample by sample.
    size: typical magnitude of its values on this rig, in the unit of its quantity.
    low: lowest value that a fit may reach.
    others: parts of the curve that a constant of the rig or an effect stands for, keys of `PARTS`,
        as the recording visits the curve.
    parts: parts that an effect is by definition, however often places were visited.
    """

    kind: LawKind
    knots: Floats
    seen: Floats
    size: float
    low: float
    others: tuple[str, ...] = ()
    parts: tuple[str, ...] = ()

    @cached_property
    def acts(self) -> Mask | None:
        """Return at which samples each value may act, (n, k); None for all values at all samples.

        A command goes on acting after it has passed: command and drive have memories. An element
        of hysteresis always acts.
        """
        if self.kind.variable is Variable.COMMAND or self.kind.remembers:
            return None
        count = len(self.knots)
        z = locate_on_knots(self.kind, self.knots, self.seen)[:, None]
        if self.kind.is_periodic:
            apart = np.mod(z - np.arange(count), count)
            return np.minimum(apart, count - apart) < REACH
        return np.abs(np.clip(z, 0, count - 1) - np.arange(count)) < REACH

    @cached_property
    def visits(self) -> Floats:
        """Return how many samples lie nearest to each knot, (k,)."""
        z = locate_on_knots(self.kind, self.knots, self.seen)
        nearest = np.rint(z).astype(int)
        count = len(self.knots)
        nearest = nearest % count if self.kind.is_periodic else np.clip(nearest, 0, count - 1)
        return np.bincount(nearest, minlength=count).astype(float)

    @cached_property
    def gauges(self) -> Floats:
        """Return weights (parts, k) of the values whose sums are held at 0.

        Otherwise a constant of the rig, or the level of a dry friction, and the same part of the
        law make one twin many times over, and neither has a size. A part of the law that others
        stand for has no share in it.
        """
        shapes = [PARTS[part](self.knots) * self.visits for part in self.others]
        shapes += [PARTS[part](self.knots) for part in self.parts]
        weights = np.array(shapes).reshape(-1, len(self.knots))
        return np.asarray(weights / np.abs(weights).sum(axis=1, keepdims=True))

    def make_law(self, values: Floats) -> Law:
        """Return the law with these values (k,)."""
        return Law(tuple(self.knots.tolist()), tuple(float(v) for v in values))

    def put(self, theta: Floats, values: Floats) -> int:
        """Put the law with these values into theta (SIZE,); return the slot that it has there."""
        slot = find_slot(theta, self.kind)
        put_law(theta, slot, self.kind.name, self.make_law(values))
        return slot

    def list_free(self, slot: int) -> tuple[Free, ...]:
        """Return the values as free parameters of a fit of theta with the law in a slot."""
        at = LAWS + slot * LAW_SIZE + VALUES
        high = LIMITS[self.kind.role]
        return tuple(
            Free(
                f"{self.kind.name}.{k}",
                self.kind.quantity.unit,
                (at + k,),
                (1.0,),
                self.low,
                high,
                self.size,
                acts=None if self.acts is None else self.acts[:, k],
            )
            for k in range(len(self.knots))
        )

    def get_values(self, theta: Floats) -> Floats:
        """Return the values (k,) that theta (SIZE,) holds."""
        at = LAWS + find_slot(theta, self.kind) * LAW_SIZE + VALUES
        return theta[at : at + len(self.knots)].copy()


def find_slot(theta: Floats, kind: LawKind) -> int:
    """Return the slot of theta that holds a law of this kind, or else the first empty slot.

    Raises LookupError where every slot holds a law of another kind.
    """
    numbers = theta[LAWS::LAW_SIZE][:MOST_LAWS].astype(int)
    own = np.flatnonzero(numbers == 1 + KINDS.index(kind))
    free: Ints = own if len(own) else np.flatnonzero(numbers == 0)
    if not len(free):
        raise LookupError(f"expected an empty slot for {kind.name}, found none")
    return int(free[0])


def list_curves(case: Case, theta: Floats, effects: tuple[str, ...]) -> list[Curve]:
    """Return a curve of every kind that this recording can show.

    theta: (SIZE,) of the twin, through whose sensors the motion is seen.
    effects: of the twin; dry friction among them may also become less along a curve.
    """
    here, shaft_turn = compute_motion(case, theta), find_shaft_turn(case.signals)
    fades = is_fading(here, case.signals.command, case.state.deviations[2:])
    curves = []
    for kind in KINDS:
        if _is_possible(case, kind) and not (fades and kind.variable is Variable.TIME):
            seen = _list_places(case, here, kind.variable)
            turn = shaft_turn if kind.variable is Variable.SHAFT else 2 * np.pi
            if _is_visited(kind, seen, turn):
                curves.append(_make_curve(kind, seen, case, effects, turn))
    return curves


def _is_visited(kind: LawKind, seen: Floats, turn: float) -> bool:
    """Return whether a law of a kind has knots over the places that were visited, (n,).

    turn: length of the turn that a periodic law is a curve over; 0 for a turn that is not known.
    """
    if kind.remembers:
        return bool(decisions.LAW_LEAST_WAY * np.quantile(seen, 0.999) > LEAST_WAY)
    if kind.variable is Variable.SHAFT:
        return bool(0.0 < turn <= np.ptp(seen))
    low, high = _find_ends(kind, seen)
    return bool(low < high)


def _find_ends(kind: LawKind, seen: Floats) -> tuple[float, float]:
    """Return the lowest and the highest place that a law of a kind is about, without outliers.

    seen: (n,) places that were visited. A command that is on for two samples in a thousand visits
        a single place.
    """
    outer = 0.0 if kind.variable is Variable.TIME else 0.001
    low, high = np.quantile(seen, [outer, 1.0 - outer])
    return float(low), float(high)


def _is_possible(case: Case, kind: LawKind) -> bool:
    """Return whether the joints and the command that a law is about are there.

    What belongs to one recording alone is no law: it would be played back in every other.
    """
    signals = case.signals
    needs_pole = kind.place is Place.POLE or kind.variable in (Variable.ANGLE, Variable.RATE)
    # gravity, which acts on the pole, shows how fast time goes
    needs_pole = needs_pole or kind.role in (Role.ANGLE_ERROR, Role.PACE)
    needs_cart = kind.place in (Place.COMMAND, Place.DRIVE, Place.CART)
    needs_cart = needs_cart or kind.variable in OF_CART
    return not (
        kind.of_recording
        or (needs_pole and signals.pole is None)
        or (needs_cart and signals.cart is None)
        or (kind.place in (Place.COMMAND, Place.DRIVE) and not np.any(signals.command))
    )


def _list_places(case: Case, here: Motion, variable: Variable) -> Floats:
    """Return where a recording visited a variable, (n,)."""
    if variable is Variable.COMMAND:
        return np.concatenate([case.signals.command, -case.signals.command])
    if variable is Variable.TIME:
        return case.signals.clock_s
    if variable is Variable.ANGLE:
        return np.mod(here.th, 2 * np.pi)
    if variable in (Variable.WAY, Variable.TURN):
        return _measure_ways(case, here.x if variable is Variable.WAY else here.th)
    places: Floats = {
        Variable.POSITION: here.x,
        Variable.SHAFT: here.x,
        Variable.VELOCITY: here.v,
        Variable.RATE: here.w,
    }[variable]
    return places


def _measure_ways(case: Case, positions: Floats) -> Floats:
    """Return half of the way (n,) since a joint last turned round, sample by sample.

    An element that slips one way slips the other way after twice its own way.
    """
    ways = np.zeros(len(positions))
    for part in case.signals.stretches:
        here = positions[part]
        turned = np.flatnonzero(np.diff(np.sign(np.diff(here)))) + 1
        begins = np.concatenate([[0], turned])
        last = begins[np.searchsorted(begins, np.arange(len(here)), side="right") - 1]
        ways[part] = 0.5 * np.abs(here - here[last])
    return ways


def _make_curve(
    kind: LawKind, seen: Floats, case: Case, effects: tuple[str, ...], turn: float
) -> Curve:
    count = decisions.LAW_KNOTS
    if kind.variable is Variable.TIME:
        wanted = np.ptp(seen) / decisions.LAW_SECONDS_A_KNOT
        count = int(np.clip(wanted, 4, decisions.LAW_MOST_KNOTS))
    if kind.is_periodic:
        knots = spread_turn(count, turn)
    else:
        first, last = _find_ends(kind, seen)
        first = decisions.LAW_LEAST_WAY * last if kind.remembers else first
        knots = spread_knots(kind, first, last, count)
    scale, per = SCALES[kind.role]
    size = 0.1 * case.scales[scale] / case.scales[per]
    low = LEAST_GAIN if kind.role is Role.GAIN else -LIMITS[kind.role]
    if kind.remembers or _is_all_dry(kind, effects):
        low = 0.0  # friction takes energy away
    others, parts = _list_others(kind, case, effects), _list_parts(kind, effects)
    return Curve(kind, knots, seen, size, low, others, parts)


def refine_knots(curve: Curve) -> Curve | None:
    """Return the curve with twice as many knots, if a law can hold more; else None.

    A law over time keeps its knots: it is about slow changes.
    """
    count = min(2 * len(curve.knots), decisions.LAW_MOST_KNOTS)
    if count == len(curve.knots) or curve.kind.variable is Variable.TIME:
        return None
    knots = spread_knots(curve.kind, curve.knots[0], curve.knots[-1], count)
    if curve.kind.is_periodic:
        knots = spread_turn(count, compute_turn(curve.knots))
    return replace(curve, knots=knots)


def _list_others(kind: LawKind, case: Case, effects: tuple[str, ...]) -> tuple[str, ...]:
    """Return the parts of a law that constants, dry friction and effects stand for."""
    constants = {constant.name for constant in list_rig_parameters(case.twin)}
    others = []
    for key in ((kind.role, None), (kind.role, kind.variable)):
        name, part = CONSTANTS.get(key, ("", ""))
        if name in constants and not _is_all_dry(kind, effects):
            others.append(part)
        if key in NAMED:
            others.append(NAMED[key])
        if key in LEVELS and _has_friction(kind, effects):
            others.append(LEVELS[key])
    return tuple(others)


def _list_parts(kind: LawKind, effects: tuple[str, ...]) -> tuple[str, ...]:
    """Return the parts of a law that effects are by definition."""
    of_kind = (EFFECTS[name] for name in effects if EFFECTS[name].law_kind == kind.name)
    return tuple(part for effect in of_kind for part in effect.law_parts)


def _is_all_dry(kind: LawKind, effects: tuple[str, ...]) -> bool:
    """Return whether a law is all the dry friction of its place.

    Such a curve is negative nowhere. So it keeps its share of a drag: a curve whose share is held
    at 0 (`Curve.gauges`) is negative somewhere, or 0.
    """
    return kind.role in DRY and not _has_friction(kind, effects)


def _has_friction(kind: LawKind, effects: tuple[str, ...]) -> bool:
    """Return whether effects hold the level, or the step at rest, that a law could hold as well.

    The level of an elastic friction is no constant: a law of the level cannot take from it.
    """
    forms = LEVEL_FORMS if kind.role in DRY else FRICTION_FORMS
    laws = (EFFECTS[name] for name in effects)
    return any(law.form in forms and law.place is kind.place for law in laws)
