"""Check whether a named effect has the shape of its law: a guard against the nearest name.

With the named effects fitted, what is still missing is asked again, and an effect is in doubt when
the answer is about the very variables that the effect itself depends on. Friction that grows with
time leaves, under a constant friction's name, a force along the motion that changes with time; a
spring that hardens leaves, under a straight spring's, a curve over the position. What is left
about other variables says that something else is missing, and speaks against no name.

A smoothed motion leaves something under the right name, too: where a joint hardly moves, the sign
of its rate is as wrong as the rate. So what the twin's own noisy runs leave is taken off.
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
    make_balance,
)
from pendulum_sysid.finding.localisation.explain import explain, is_more_than_chance
from pendulum_sysid.finding.localisation.inspection import list_questions, make_tables
from pendulum_sysid.finding.localisation.questions import Cost, Question
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.own_runs import record_own_runs
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.records import Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values

LIKE_A_CONSTANT = {
    "cart_position",
    "time",
    "pole_angle",
}  # a constant push may turn out to be a curve over one of these


@dataclass(frozen=True)
class WrongShape:
    """Say that what is seen of a named effect does not have the shape of its law.

    effect: its name.
    share: power that its own variables still explain, over what all effects of these variables
        explain.
    variable: on which what is left depends.
    place: to which the shape points.
    """

    effect: str
    share: float
    variable: str
    place: str


@dataclass(frozen=True)
class Remainder:
    """Hold what an equation still lacks with the named effects fitted.

    Powers are in units of the equation's own size.

    table: of all questions.
    gains: key -> power that the question would take away.
    left: power that is missing now, noise included.
    """

    table: Table
    gains: dict[str, float]
    left: float

    @property
    def best(self) -> str:
        """Return the question that takes away most."""
        return max(self.gains, key=lambda key: self.gains[key])

    @property
    def noise(self) -> float:
        """Return the power of the sensors' noise, in units of the equation's own size."""
        return self.table.balance.noise**2 / max(self.table.balance.size**2, 1e-300)

    def is_sure(self, key: str) -> bool:
        """Return whether a question's gain is more than chance."""
        return is_more_than_chance(self.table, key)


def measure_remainders(case: Case, fit: Fit, tables: Sequence[Table] = ()) -> list[Remainder]:
    """Return what is left of each equation under a fit.

    tables: of the fit, seen through its own twin; none where they are not made yet.
    """
    case, unfiltered = thin_out(case), _take_out_static_filters(fit.theta)
    if not tables or not np.array_equal(unfiltered, fit.theta):
        tables = make_tables(case, fit.theta, unfiltered)
    return [
        Remainder(
            table,
            _compute_gains(table),
            table.compute_loss(()) / max(table.balance.size**2, 1e-300),
        )
        for table in tables
    ]


def _compute_gains(table: Table) -> dict[str, float]:
    """Return the power that each question would take away, in units of the equation's own size."""
    own = max(table.balance.size**2, 1e-300)
    return {key: table.compute_gain(key) / own for key in table.questions}


def take_off_own_gains(
    case: Case, theta: Floats, remainders: Sequence[Remainder]
) -> list[Remainder]:
    """Return what is left with the gains beyond those that the twin's own noisy runs show.

    theta: (SIZE,) of the twin.
    """
    case = thin_out(case)
    windows = cut_windows(case.signals, case.state, WINDOW_S)
    perfect = record_own_runs(case, theta, windows)
    if perfect is None:
        return list(remainders)
    own = {
        table.balance.equation: _compute_gains(table)
        for table in make_tables(perfect, theta, _take_out_static_filters(theta))
    }
    return [
        replace(
            remainder,
            gains={
                key: gain - own.get(remainder.table.balance.equation, {}).get(key, 0.0)
                for key, gain in remainder.gains.items()
            },
        )
        for remainder in remainders
    ]


def _take_out_static_filters(theta: Floats) -> Floats:
    """Return theta (SIZE,) without the effects that bend the command and remember nothing.

    Laws are asked about the command that was sent.
    """
    theta = theta.copy()
    for effect in CATALOGUE:
        if effect.is_static:
            theta[SLOTS[effect.name]] = get_neutral_values(effect)
    return theta


def find_wrong_shapes(
    case: Case, theta: Floats, remainders: Sequence[Remainder], named: Sequence[str]
) -> list[WrongShape]:
    """Return the named effects whose laws do not have the shape that is seen, the worst first.

    An effect is in doubt when one question about its own variables gains more than chance, is the
    best answer to what is left or near it, takes away a great part of it, and is not small beside
    what the effects of these variables explain. A question gains what it takes away beyond what it
    takes away of the twin's own runs.
    An effect without parameters, a sign, has no shape.

    theta: (SIZE,) of the fit that holds the effects.
    remainders: what it leaves.
    named: the effects.
    """
    if not decisions.CHECK_SHAPES:
        return []
    case = thin_out(case)
    sharp = compute_sharp_accelerations(case)
    physics = [name for name in named if BY_NAME[name].parameters]
    forces = [
        {
            name: compute_own_force(
                case, theta, take_out(theta, name), sharp, remainder.table.balance.equation
            )
            for name in physics
        }
        for remainder in remainders
    ]
    powers = [
        {name: compute_power(remainder.table.balance, own) for name, own in forces_of.items()}
        for remainder, forces_of in zip(remainders, forces, strict=True)
    ]
    largest = {name: max(powers_of[name] for powers_of in powers) for name in physics if powers}
    shown = [
        {
            name: forces_of[name]
            for name in physics
            if powers_of[name] > decisions.JUDGED_SHARE * largest[name]
        }
        for forces_of, powers_of in zip(forces, powers, strict=True)
    ]

    def find(left: Sequence[Remainder]) -> list[WrongShape]:
        return [
            wrong
            for remainder, own in zip(left, shown, strict=True)
            for wrong in _find_wrong_shapes_in(case, theta, remainder, own)
        ]

    shapes = find(remainders) and find(take_off_own_gains(case, theta, remainders))
    return sorted(shapes, key=lambda wrong: -wrong.share)


def _find_wrong_shapes_in(
    case: Case, theta: Floats, remainder: Remainder, forces: dict[str, Floats]
) -> list[WrongShape]:
    """Return which effects have a wrong shape in one equation.

    forces: name of an effect -> (n,) what it gives along the recording.
    """
    balance = remainder.table.balance
    about = {
        name: _find_own_variables(case, theta, name, balance.equation, own)
        for name, own in forces.items()
    }
    judged = []
    for name in forces:
        alike = [other for other in forces if other == name or about[other] & about[name]]
        explained = compute_power(balance, np.sum([forces[other] for other in alike], axis=0))
        taken = frozenset(token for other in forces if other != name for token in about[other])
        shared = len(alike) > 1
        allowed = decisions.SHARED_SHAPE_TOLERANCE if shared else decisions.SHAPE_TOLERANCE
        judged.append(_judge_shape(remainder, name, Own(about[name], taken, explained, allowed)))
    return [wrong for wrong in judged if wrong is not None]


@dataclass(frozen=True)
class Own:
    """Hold the variables of an effect.

    variables: its own.
    taken: those of other effects.
    explained: power that all effects of its variables explain.
    allowed: share of it that may be left.
    """

    variables: frozenset[str]
    taken: frozenset[str]
    explained: float
    allowed: float

    def is_about(self, question: Question) -> bool:
        """Return whether a question is about this effect.

        A constant may turn out to be a curve over a variable that belongs to no other effect.
        """
        variables = set(question.variable.split("*"))
        free = (
            self.variables == {"constant"}
            and question.cost is Cost.CURVE
            and variables <= LIKE_A_CONSTANT - self.taken
        )
        return bool(variables & self.variables) or free


def _judge_shape(remainder: Remainder, name: str, own: Own) -> WrongShape | None:
    """Return the wrong shape of an effect in one equation; None where its shape is right."""
    questions, gains = remainder.table.questions, remainder.gains
    related = {key: gain for key, gain in gains.items() if own.is_about(questions[key])}
    if not related:
        return None
    key = max(related, key=lambda k: related[k])
    gain, beyond_noise = related[key], max(remainder.left - remainder.noise, 0.0)
    chief = gain >= decisions.CHIEF_SHARE * gains[remainder.best]
    great = gain >= decisions.SHAPE_SHARE_OF_REST * beyond_noise
    large = gain >= own.allowed * own.explained
    if not (chief and great and large and remainder.is_sure(key)):
        return None
    share = gain / max(own.explained, 1e-300)
    return WrongShape(name, share, questions[key].variable, questions[key].place)


def take_out(theta: Floats, name: str) -> Floats:
    """Return theta (SIZE,) with an effect taken out."""
    less = theta.copy()
    less[SLOTS[name]] = get_neutral_values(BY_NAME[name])
    return less


def compute_own_force(
    case: Case, theta: Floats, less: Floats, sharp: Floats, equation: int
) -> Floats:
    """Return the force or torque along the recording, (n,), that a twin gives and another lacks.

    theta, less: (SIZE,) of the twin, and of the twin without an effect or a law.
    sharp: see `compute_sharp_accelerations`.
    """
    return compute_lacking(case, less, sharp, equation) - compute_lacking(
        case, theta, sharp, equation
    )


def compute_power(balance: Balance, force: Floats) -> float:
    """Return the power of a force along the recording, beyond what the twin's constants give."""
    return float(np.mean(project_out_constants(balance, force) ** 2))


def project_out_constants(balance: Balance, force: Floats) -> Floats:
    """Return what of a force (n,) the twin's constants cannot give, (rows,), in units of size."""
    rows = balance.sieve(force)
    rows = rows - balance.turned @ np.linalg.lstsq(balance.turned, rows, rcond=None)[0]
    return np.asarray(rows / max(balance.size, 1e-300))


def _find_own_variables(
    case: Case, theta: Floats, name: str, equation: int, part: Floats
) -> frozenset[str]:
    """Return the variables on which an effect's own force depends.

    They are found as those of a force that a twin without the effect lacks.
    """
    less = take_out(theta, name)
    balance = make_balance(case, less, equation)
    if balance is None:
        return frozenset()
    table = Table(
        replace(balance, lacking=balance.sieve(part), noise=0.0),
        list_questions(case, compute_motion(case, less), balance, less),
    )
    keys = explain(table) or (min(table.questions, key=lambda key: table.compute_loss((key,))),)
    return frozenset(token for key in keys for token in table.questions[key].variable.split("*"))
