"""Ask what a missing force or torque depends on: a variable, or a coefficient that varies.

A product is a coefficient that varies: whether the force per command depends on the position, the
dry friction on the time, the viscous friction on the pole's rate (Hastie and Tibshirani, J. R.
Stat. Soc. B 55 (1993) 757).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from functools import partial

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.balance import Balance, Motion
from pendulum_sysid.finding.localisation.knots import make_hats, make_sided_knots, spread_knots
from pendulum_sysid.finding.localisation.sieve import FORCE
from pendulum_twin.arrays import Floats

SECONDS_A_KNOT, MOST_TIMES = 1.0, 60
MISSING = ("missing force", "missing torque")
UNITS = ("N", "N m")


class Cost(IntEnum):
    """How much a question asks for; of two that explain as much the cheaper is right."""

    NUMBER = 0
    CURVE = 1
    PRODUCT = 2


@dataclass(frozen=True)
class Measured:
    """Say what a curve shows.

    quantity: for a person ("dry friction").
    unit: of the quantity.
    axis: the variable along which it is drawn.
    sign: +1, or -1 where the quantity holds the motion back.
    turned: the balance's column whose weight is part of the curve, if any.
    straight: True for a curve against the very variable that this column multiplies.
    """

    quantity: str
    unit: str
    axis: str
    sign: float = 1.0
    turned: str | None = None
    straight: bool = False


@dataclass(frozen=True)
class Question:
    """Hold a question about the missing force, and how its answer is drawn.

    key: unique in an equation.
    variable: on which the force may depend, as evidence names it; products with a star.
    place: of the chain, where the answer points to.
    cost: of the answer; a cheaper answer is preferred.
    measured: what its curve shows.
    make_columns: makes (n, k) along the recording.
    x: (points,) where the curve is drawn.
    drawn: (points, k) makes the curve of the k weights; None where each weight is a point.
    bends: True where a curve of the weights should be smooth.
    """

    key: str
    variable: str
    place: str
    cost: Cost
    measured: Measured
    make_columns: Callable[[], Floats]
    x: Floats
    drawn: Floats | None = None
    bends: bool = True


def make_number_question(
    key: str, variable: str, place: str, measured: Measured, column: Floats, scale: float = 1.0
) -> Question:
    """Return a question with a single number for an answer: the column's weight times a scale."""
    drawn = np.full((1, 1), scale)
    return Question(
        key,
        variable,
        place,
        Cost.NUMBER,
        measured,
        lambda: column[:, None],
        np.zeros(1),
        drawn,
        bends=False,
    )


@dataclass(frozen=True)
class Variables:
    """Hold a recording's variables by name, each with its knots and what makes the hats on them.

    Hats are made when they are needed, and no question keeps them.
    """

    bases: dict[str, tuple[Floats, Callable[[], Floats]]]

    def ask_curve(self, name: str, place: str, measured: Measured) -> Question:
        """Ask whether the force depends on a variable."""
        knots, base = self.bases[name]
        variable = "pole_angle" if name == "pole_turns" else name
        return Question(name, variable, place, Cost.CURVE, measured, base, knots)

    def ask_product(
        self, key: str, variable: str, factor: Floats, name: str, place: str, measured: Measured
    ) -> Question:
        """Ask whether the coefficient of a factor (n,) depends on a variable."""
        knots, base = self.bases[name]
        return Question(
            key, variable, place, Cost.PRODUCT, measured, lambda: factor[:, None] * base(), knots
        )


def make_time_knots(here: Motion) -> Floats:
    """Return the knots of the time, s."""
    return np.linspace(
        here.t[0], here.t[-1], int(np.clip(np.ptp(here.t) / SECONDS_A_KNOT, 2, MOST_TIMES))
    )


def make_variables(here: Motion) -> Variables:
    """Return the variables of a recording that move."""
    angle = np.mod(here.th, 2 * np.pi)
    turns = (
        spread_knots(here.th, decisions.CURVE_KNOTS)
        if np.ptp(here.th) > 2 * np.pi
        else np.zeros(1)
    )
    bases: dict[str, tuple[Floats, Callable[[], Floats]]] = {}
    for name, values, knots in (
        ("cart_position", here.x, spread_knots(here.x, decisions.CURVE_KNOTS)),
        ("pole_angle", angle, spread_knots(angle, decisions.ANGLE_KNOTS)),
        ("pole_turns", here.th, turns),
        ("command", here.u, spread_knots(here.u, decisions.CURVE_KNOTS)),
        ("time", here.t, make_time_knots(here)),
    ):
        if len(knots) > 2:
            bases[name] = (knots, partial(make_hats, values, knots))
    for name, values in (("cart_velocity", here.v), ("pole_rate", here.w)):
        if np.ptp(values) > 0:
            bases[name] = (make_sided_knots(values)[0], partial(_make_sided_hats, values))
    return Variables(bases)


def _make_sided_hats(values: Floats) -> Floats:
    return make_sided_knots(values)[1]


def make_questions(here: Motion, balance: Balance) -> list[Question]:
    """Return the questions about state, command and time in an equation."""
    asker = make_variables(here)
    return _ask_force(here, asker) if balance.equation == FORCE else _ask_torque(here, asker)


def _ask_force(here: Motion, asker: Variables) -> list[Question]:
    missing, unit = MISSING[0], UNITS[0]
    questions = [
        make_number_question(
            "constant",
            "constant",
            "cart",
            Measured(missing, unit, "constant"),
            np.ones_like(here.v),
        )
    ]
    for name, place, turned in (
        ("cart_velocity", "cart", "viscous"), ("cart_position", "cart", None),
        ("time", "cart", None),
        ("pole_angle", "cart", None), ("pole_rate", "cart", None), ("command", "command", "drive"),
    ):  # fmt: skip
        if name in asker.bases:
            questions.append(
                asker.ask_curve(
                    name, place, Measured(missing, unit, name, 1.0, turned, turned is not None)
                )
            )
    gain = Measured("force per command", "N", "", 1.0, "drive")
    viscous, dry = (
        Measured("viscous friction", "N s/m", "", -1.0, "viscous"),
        Measured("dry friction", "N", "", -1.0),
    )
    state = ("cart_position", "time", "pole_rate", "pole_angle")
    for key, by, factor, what, names in (
        (
            "command",
            "command",
            here.u,
            gain,
            ("cart_position", "cart_velocity", "time", "pole_angle"),
        ),
        ("cart_velocity", "cart_velocity", here.v, viscous, state),
        ("cart_direction", "cart_velocity", np.sign(here.v), dry, (*state, "command")),
    ):
        questions += _make_products(
            asker,
            key,
            by,
            factor,
            what,
            names,
            _locate_gain if key == "command" else lambda _: "cart",
        )
    return questions


def _ask_torque(here: Motion, asker: Variables) -> list[Question]:
    missing, unit = MISSING[1], UNITS[1]
    questions = [
        make_number_question(
            "constant",
            "constant",
            "pole",
            Measured(missing, unit, "constant"),
            np.ones_like(here.w),
        )
    ]
    for name, turned in (
        ("pole_rate", "viscous"), ("pole_angle", None), ("pole_turns", None), ("time", None),
        ("cart_position", None),
        ("cart_velocity", None), ("command", None),
    ):  # fmt: skip
        if name in asker.bases:
            questions.append(
                asker.ask_curve(
                    name, "pole", Measured(missing, unit, name, 1.0, turned, turned is not None)
                )
            )
    viscous, dry = (
        Measured("viscous friction", "N m s", "", -1.0, "viscous"),
        Measured("dry friction", "N m", "", -1.0),
    )
    names = ("pole_angle", "time", "cart_position", "cart_velocity")
    for key, factor, what in (
        ("pole_rate", here.w, viscous),
        ("pole_direction", np.sign(here.w), dry),
    ):
        questions += _make_products(asker, key, "pole_rate", factor, what, names, lambda _: "pole")
    return questions


def _locate_gain(name: str) -> str:
    """Return the place of a gain that a variable changes.

    The command's way to the drive knows the time, not the motion.
    """
    return "command" if name == "time" else "drive"


def _make_products(
    asker: Variables,
    key: str,
    by: str,
    factor: Floats,
    what: Measured,
    names: tuple[str, ...],
    place: Callable[[str], str],
) -> list[Question]:
    """Return the questions whether a factor's coefficient depends on any of some variables."""
    if not np.any(factor):
        return []
    return [
        asker.ask_product(
            f"{key}*{name}", f"{by}*{name}", factor, name, place(name),
            Measured(what.quantity, what.unit, name, what.sign, what.turned),
        )
        for name in names
        if name in asker.bases
    ]  # fmt: skip
