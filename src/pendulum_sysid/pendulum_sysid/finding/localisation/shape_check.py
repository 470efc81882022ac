"""Whether what was named has the shape of its law: a guard against the nearest name.

With the named effects fitted, what is still missing is asked again, and an effect is in doubt when
the answer is about the very variables that the effect itself depends on. Friction that grows with
time leaves, under a constant friction's name, a force along the motion that changes with time; a
spring that hardens leaves, under a straight spring's, a curve over the position. What is left
about other variables says that something else is missing, and speaks against no name.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.balance import (
    Balance,
    compute_lacking,
    compute_motion,
    compute_sharp_accelerations,
    make_balances,
)
from pendulum_sysid.finding.localisation.explain import explain, is_more_than_chance
from pendulum_sysid.finding.localisation.inspection import list_questions, make_table
from pendulum_sysid.finding.localisation.questions import Cost, Question
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import HALF_STEP_S, Form
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values
from pendulum_twin.signals import Floats

LIKE_A_CONSTANT = {
    "cart_position",
    "time",
    "pole_angle",
}  # a constant push may turn out to be a curve over one of these


@dataclass(frozen=True)
class Misfit:
    """Say that a named effect has not the shape of its law.

    share: power that its own variables still explain, over what all effects of these variables
    explain. variable: on which what is left depends. place: to which the shape points.
    """

    effect: str
    share: float
    variable: str
    place: str


@dataclass(frozen=True)
class Remainder:
    """Hold one equation with the named effects fitted, and what every question would still take away.

    before: power beyond noise that was missing with parameters alone; left: that is missing now,
    noise included; both, as the gains, in units of the equation's own size.
    """

    table: Table
    gains: dict[str, float]
    before: float
    left: float

    @property
    def best(self) -> str:
        """Return the question that takes away most."""
        return max(self.gains, key=lambda key: self.gains[key])

    @property
    def noise(self) -> float:
        """Return the power of the sensors' noise, in units of the equation's own size."""
        return (self.table.balance.noise / max(self.table.balance.size, 1e-300)) ** 2

    def sure(self, key: str) -> bool:
        """Return whether a question's gain is more than chance."""
        return is_more_than_chance(self.table, key)


def measure_remainders(case: Case, fit: Fit, base: Fit) -> list[Remainder]:
    """Return what is left of each equation under a fit; base: the fit of parameters alone."""
    case = thin_out(case)
    here, found = compute_motion(case, _take_out_static_filters(fit.theta)), []
    first = {one.equation: Table(one, []) for one in make_balances(case, base.theta)}
    for balance in make_balances(case, fit.theta):
        if balance.equation not in first:
            continue
        table, own = make_table(case, here, balance, fit.theta), max(balance.size, 1e-300) ** 2
        gains = {key: table.gain(key) / own for key in table.asked}
        before = max(first[balance.equation].loss(()) - balance.noise**2, 0.0) / own
        found.append(Remainder(table, gains, before, table.loss(()) / own))
    return found


def _take_out_static_filters(theta: Floats) -> Floats:
    """Return words without the effects that bend the command and remember nothing: laws are asked of what was sent."""
    theta = theta.copy()
    for effect in BY_NAME.values():
        if effect.form is Form.FILTER and (
            effect.memory is None or effect.memory(HALF_STEP_S) == 0
        ):
            theta[SLOTS[effect.name]] = get_neutral_values(effect)
    return theta


def find_misfits(
    case: Case, theta: Floats, rest: Sequence[Remainder], named: Sequence[str]
) -> list[Misfit]:
    """Return the named effects whose laws do not have the shape that the recording shows, the worst first.

    An effect is in doubt when one question about its own variables gains more than chance, is the
    best answer to what is left or near it, takes away a great part of it, and is not small beside
    what the effects of these variables explain.
    theta: (SIZE,) of the fit that holds the effects; rest: what it leaves. An effect without
    parameters, a sign, has no shape.
    """
    if not decisions.CHECK_SHAPES:
        return []
    case = thin_out(case)
    sharp = compute_sharp_accelerations(case)
    physics = [name for name in named if BY_NAME[name].parameters]
    parts = [
        {name: _compute_share(case, theta, sharp, one, name) for name in physics} for one in rest
    ]
    powers = [
        {name: _compute_power(one.table.balance, part) for name, part in p.items()}
        for one, p in zip(rest, parts, strict=True)
    ]
    found = []
    for one, part, power in zip(rest, parts, powers, strict=True):
        shown = {
            name: part[name]
            for name in physics
            if power[name] > decisions.JUDGED_SHARE * max(p[name] for p in powers)
        }
        found += _find_misfits_in(case, theta, one, shown)
    return sorted(found, key=lambda one: -one.share)


def _find_misfits_in(
    case: Case, theta: Floats, one: Remainder, parts: dict[str, Floats]
) -> list[Misfit]:
    """Return which effects misfit one equation; parts: what each gives along the recording."""
    balance = one.table.balance
    about = {
        name: _find_own_variables(case, theta, name, balance.equation, part)
        for name, part in parts.items()
    }
    found = []
    for name in parts:
        alike = [other for other in parts if other == name or about[other] & about[name]]
        explained = _compute_power(balance, np.sum([parts[other] for other in alike], axis=0))
        taken = frozenset(token for other in parts if other != name for token in about[other])
        found.append(
            _judge_shape(
                one,
                name,
                Own(
                    about[name],
                    taken,
                    explained,
                    decisions.SHAPE_TOLERANCE
                    if len(alike) == 1
                    else decisions.SHARED_SHAPE_TOLERANCE,
                ),
            )
        )
    return [one for one in found if one is not None]


@dataclass(frozen=True)
class Own:
    """Hold an effect's own variables, those of other effects, what all of its variables explain, and what may be left."""

    variables: frozenset[str]
    taken: frozenset[str]
    explained: float
    allowed: float

    def concerns(self, question: Question) -> bool:
        """Return whether a question is about this effect; a constant may turn out to be a curve that is no other's."""
        asked = set(question.variable.split("*"))
        free = (
            self.variables == {"constant"}
            and question.cost is Cost.CURVE
            and asked <= LIKE_A_CONSTANT - self.taken
        )
        return bool(asked & self.variables) or free


def _judge_shape(one: Remainder, name: str, own: Own) -> Misfit | None:
    asked = one.table.asked
    related = {key: gain for key, gain in one.gains.items() if own.concerns(asked[key])}
    if not related:
        return None
    key = max(related, key=lambda k: related[k])
    gain = related[key]
    chiefly = gain >= decisions.CHIEF_SHARE * one.gains[
        one.best
    ] and gain >= decisions.SHAPE_SHARE_OF_REST * max(one.left - one.noise, 0.0)
    if not chiefly or gain < own.allowed * own.explained or not one.sure(key):
        return None
    return Misfit(name, gain / max(own.explained, 1e-300), asked[key].variable, asked[key].place)


def take_out(theta: Floats, name: str) -> Floats:
    """Return words with an effect taken out."""
    less = theta.copy()
    less[SLOTS[name]] = get_neutral_values(BY_NAME[name])
    return less


def _compute_share(case: Case, theta: Floats, sharp: Floats, one: Remainder, name: str) -> Floats:
    """Return the force or torque that an effect gives along the recording, (n,)."""
    with_it, less = (
        compute_lacking(case, w, sharp, one.table.balance.equation)
        for w in (theta, take_out(theta, name))
    )
    return less - with_it


def _compute_power(balance: Balance, part: Floats) -> float:
    """Return the power of a force along the recording, beyond what the twin's own words could give."""
    rows = balance.sieve(part)
    rows = rows - balance.turned @ np.linalg.lstsq(balance.turned, rows, rcond=None)[0]
    return float(np.mean(rows**2)) / max(balance.size, 1e-300) ** 2


def _find_own_variables(
    case: Case, theta: Floats, name: str, equation: int, part: Floats
) -> frozenset[str]:
    """Return the variables that an effect's own force depends on, asked as of a force that a twin without it lacks."""
    less = take_out(theta, name)
    same = [one for one in make_balances(case, less) if one.equation == equation]
    if not same:
        return frozenset()
    balance = same[0]
    table = Table(
        replace(balance, lacking=balance.sieve(part), noise=0.0),
        list_questions(case, compute_motion(case, less), balance, less),
    )
    keys = explain(table) or (min(table.asked, key=lambda key: table.loss((key,))),)
    return frozenset(token for key in keys for token in table.asked[key].variable.split("*"))


def is_outweighed(rest: Sequence[Remainder]) -> bool:
    """Return whether one thing that is still missing is larger than all that was explained, in both equations together."""
    explained = sum(one.before - one.left for one in rest)
    return decisions.CHECK_OUTWEIGHED and any(
        one.gains[one.best] > max(explained, 0.0) and one.sure(one.best) for one in rest
    )
