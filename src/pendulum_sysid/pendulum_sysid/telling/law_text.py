"""A measured law in words: its formula, its sentence, and the units of its parameters."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.measuring.naming import NamedCurve, select_shapes
from pendulum_sysid.measuring.shape_fit import FittedShape
from pendulum_sysid.measuring.shapes import Shape
from pendulum_twin.laws.kind import LawKind, Role, Variable
from pendulum_twin.laws.law import compute_turn

HYSTERESIS_SHARES = (0.1, 0.9)  # of the friction: those ways are said of it
NO_FRICTION = "Where all dry friction together is below 0, there is none."
RATIO = "1"  # the unit of a ratio


def write_formula(named: NamedCurve) -> str:
    """Return the formula with its numbers and units; "" for a curve without a shape."""
    shape, kind = named.shape, named.curve.kind
    if shape is None:
        return ""
    numbers = {n: f"{v:.3g}" for n, v in zip(shape.names, shape.values, strict=True)}
    text = (
        shape.shape.text.format(**numbers)
        .replace("+ -", "- ")
        .replace("x0", f"{named.curve.knots[0]:.3g}")
    )
    unit = "" if kind.quantity.unit == RATIO else f" in {kind.quantity.unit}"
    along = "" if kind.along.unit == RATIO else f" in {kind.along.unit}"
    return f"{kind.quantity.words}{unit} = {text}, x: {kind.along.words}{along}"


def write_sentence(named: NamedCurve) -> str:
    """Return what was measured, for a person."""
    if named.curve.kind.remembers and np.any(named.values):
        return _write_hysteresis(named)
    kind, unit = named.curve.kind, named.curve.kind.quantity.unit.replace("1", "")
    subject = f"The {kind.quantity.words} depends on the {kind.along.words}"
    if kind.variable is Variable.SHAFT:
        subject += f", which is {compute_turn(named.curve.knots):.3g} m"
    if named.shape is None:
        seen = named.curve.visits >= decisions.LAW_VISITED * named.curve.visits.mean()
        values, knots = named.values[seen], named.curve.knots[seen]
        low, high = int(np.argmin(values)), int(np.argmax(values))
        if named.is_doubted:
            why = "of its formula other blocks of time leave nothing sure"
        elif select_shapes(kind):
            why = "no formula that was tried does as well as the measured curve"
        else:
            why = "no formula was tried"
        sentence = (
            f"{subject}: from {values[low]:.3g} {unit} at {knots[low]:.3g} to {values[high]:.3g} "
            f"{unit} at {knots[high]:.3g} {kind.along.unit}; {why}."
        )
        return _add_friction(sentence.replace("  ", " ").replace(" 1;", ";"), named)
    numbers = _write_numbers(named.shape, kind)
    words = named.shape.shape.words.format(**numbers, x=_name_step(kind))
    return _add_friction(f"{subject}: it {words}.", named)


def _write_numbers(shape: FittedShape, kind: LawKind) -> dict[str, str]:
    """Return each parameter with its interval and unit, as the words of its shape say it."""
    half = decisions.INTERVAL_DEVIATIONS * shape.deviations
    numbers = {}
    for name, value, wide in zip(shape.names, shape.values, half, strict=True):
        unit = kind.quantity.unit if name in shape.shape.factors else kind.along.unit
        suffix = "" if unit == RATIO else f" {unit}"
        numbers[name] = f"{value:.3g} [{value - wide:.3g}, {value + wide:.3g}]{suffix}"
    return numbers


def _name_step(kind: LawKind) -> str:
    """Return the step of the variable for which a growth is said: its unit."""
    return "unit" if kind.along.unit == RATIO else kind.along.unit


def list_units(shape: Shape, kind: LawKind) -> dict[str, str]:
    """Return the unit of each parameter of a shape; "1" for a ratio."""
    along = kind.along.unit
    units = dict.fromkeys(shape.more, along)
    for name in shape.factors:
        power = shape.powers.get(name, 0)
        units[name] = kind.quantity.unit
        if power and along != RATIO:
            bracketed = f"({along})" if "/" in along else along
            units[name] += f"/{bracketed}" + (f"^{power}" if power > 1 else "")
    return units


def _add_friction(sentence: str, named: NamedCurve) -> str:
    """Return the sentence with what a dry friction below 0 means, where the law has one."""
    is_dry = named.curve.kind.role in (Role.CART_DRY, Role.POLE_DRY)
    return f"{sentence} {NO_FRICTION}" if is_dry and np.any(named.values < 0.0) else sentence


def _write_hysteresis(named: NamedCurve) -> str:
    """Return how much friction slips, and after which way, for a person."""
    kind, knots = named.curve.kind, named.curve.knots
    share = np.cumsum(named.values) / np.sum(named.values)
    first, last = (knots[np.searchsorted(share, part)] for part in HYSTERESIS_SHARES)
    words = kind.quantity.words
    return (
        f"{words[0].upper()}{words[1:]}: {np.sum(named.values):.3g} {kind.quantity.unit} in all. "
        f"After each reversal it grows like a spring, and slips from {first:.3g} to {last:.3g} "
        f"{kind.along.unit} (a tenth of it to nine tenths of it)."
    )
