"""Hold a measured law: values at knots on an even grid, with a smooth curve through them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from reprlib import repr as shown

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.laws import BY_NAME
from pendulum_twin.laws.kind import LIMITS, LawKind, Variable
from pendulum_twin.rig import check_number, describe_unknown_key
from pendulum_twin.suggest import hint_at_names

FEWEST_KNOTS, MOST_KNOTS = 2, 128
MOST_LAWS = 7  # in a twin: the parameter vector has so many slots
FEWEST_KNOTS_OF_TURN = 4
UNEVEN_SPACING = 1e-6  # of a spacing, by which a knot may be off the even grid: files round
LARGEST_KNOT = 1e9
LEAST_WAY = 1e-9  # m or rad; way after which friction may slip


@dataclass(frozen=True)
class Law:
    """Hold a curve: cubic between evenly spaced knots, constant beyond the outermost knots.

    Hysteresis is no curve: each knot is an element of its own (`hysteresis`), and knots rise by a
    ratio.

    knots: rising, in the unit of the kind's variable. Of a turn (of the pole, of the shaft) they
        divide the turn: the curve goes on from the last knot to the first.
    values: at the knots, in the unit of the kind's quantity.
    """

    knots: tuple[float, ...]
    values: tuple[float, ...]


def spread_knots(kind: LawKind, first: float, last: float, count: int) -> Floats:
    """Return so many knots of a kind from the first to the last."""
    spread = np.geomspace if kind.remembers else np.linspace
    return np.asarray(spread(first, last, count))


def compute_step(kind: LawKind, knots: Sequence[float] | Floats) -> float:
    """Return by how much, or by which ratio, knots of a kind rise."""
    steps = len(knots) - 1
    if kind.remembers:
        return float((knots[-1] / knots[0]) ** (1.0 / steps))
    return float((knots[-1] - knots[0]) / steps)


def locate_on_knots(kind: LawKind, knots: Floats, at: Floats) -> Floats:
    """Return how many steps (n,) places at (n,) lie above the first knot."""
    step = compute_step(kind, knots)
    if kind.remembers:
        return np.asarray(np.log(np.maximum(at, LEAST_WAY) / knots[0]) / np.log(step))
    return np.asarray((np.asarray(at, dtype=np.float64) - knots[0]) / step)


def make_law(kind: LawKind, knots: Sequence[float], values: Sequence[float]) -> Law:
    """Return a law of this kind; raise BadInputError for knots or values that it cannot have."""
    return check_law(kind.name, {kind.knots_key: list(knots), kind.values_key: list(values)})


def check_law(name: str, content: object) -> Law:
    """Return the law of a twin file's mapping; raise BadInputError naming what is wrong."""
    where = f"measured_laws: {name}"
    if name not in BY_NAME:
        raise BadInputError(f"measured_laws: unknown law {name}; {hint_at_names(name, BY_NAME)}")
    kind = BY_NAME[name]
    keys = (kind.knots_key, kind.values_key)
    if not isinstance(content, Mapping):
        raise BadInputError(f"{where}: expected {' and '.join(keys)}, found {shown(content)}")
    for key in content:
        if key not in keys:
            raise BadInputError(describe_unknown_key(where, str(key), keys))
    limit = LIMITS[kind.role]
    knots = _check_numbers(where, keys[0], content, LARGEST_KNOT)
    values = _check_numbers(where, keys[1], content, limit)
    if len(values) != len(knots):
        raise BadInputError(
            f"{where}: expected as many {keys[1]} as {keys[0]}, found {len(values)} and "
            f"{len(knots)}"
        )
    _check_knots(f"{where}: {keys[0]}", kind, knots)
    return Law(knots, values)


def _check_numbers(
    where: str, key: str, content: Mapping[str, object], limit: float
) -> tuple[float, ...]:
    numbers = content.get(key)
    if not isinstance(numbers, Sequence) or isinstance(numbers, str):
        raise BadInputError(f"{where}: {key}: expected a list of numbers, found {shown(numbers)}")
    if not FEWEST_KNOTS <= len(numbers) <= MOST_KNOTS:
        raise BadInputError(
            f"{where}: {key}: expected {FEWEST_KNOTS} to {MOST_KNOTS} numbers, "
            f"found {len(numbers)}"
        )
    return tuple(check_number(f"{where}: {key}", value, -limit, limit) for value in numbers)


def _check_knots(where: str, kind: LawKind, knots: tuple[float, ...]) -> None:
    if kind.remembers:
        _check_ways(where, knots)
        return
    steps = np.diff(knots)
    mean = (knots[-1] - knots[0]) / (len(knots) - 1)
    if mean <= 0 or np.any(np.abs(steps - mean) > UNEVEN_SPACING * mean):
        raise BadInputError(f"{where}: expected rising, evenly spaced knots, found {shown(knots)}")
    if not kind.is_periodic:
        return
    if len(knots) < FEWEST_KNOTS_OF_TURN:
        raise BadInputError(
            f"{where}: expected at least {FEWEST_KNOTS_OF_TURN} knots over a turn, found "
            f"{len(knots)}"
        )
    off = abs(mean * len(knots) - math.tau)
    if kind.variable is Variable.ANGLE and off > len(knots) * UNEVEN_SPACING:
        raise BadInputError(
            f"{where}: expected knots that divide a turn of {math.tau:.9f} rad, found "
            f"{len(knots)} knots {mean:.9g} rad apart"
        )


def _check_ways(where: str, knots: tuple[float, ...]) -> None:
    logs = np.log(knots) if min(knots) >= LEAST_WAY else np.zeros(2)
    steps, mean = np.diff(logs), (logs[-1] - logs[0]) / (len(logs) - 1)
    if mean <= 0 or np.any(np.abs(steps - mean) > UNEVEN_SPACING):
        raise BadInputError(
            f"{where}: expected knots of at least {LEAST_WAY:g} that rise by one ratio, found "
            f"{shown(knots)}"
        )


def spread_turn(count: int, turn: float = math.tau) -> Floats:
    """Return so many knots over a turn: of the pole, rad, or of another length."""
    return np.arange(count, dtype=np.float64) * (turn / count)


def compute_turn(knots: Sequence[float] | Floats) -> float:
    """Return the length of the turn that the knots of a periodic law divide."""
    return float((knots[-1] - knots[0]) / (len(knots) - 1) * len(knots))


def make_curve_matrix(kind: LawKind, knots: Floats, at: Floats) -> Floats:
    """Return the weights (n, knots) with which the values at the knots make the curve at (n,)."""
    count = len(knots)
    z = locate_on_knots(kind, knots, at)
    rows = np.arange(len(z))
    weights = np.zeros((len(z), count))
    if kind.is_periodic:
        z = np.mod(z, count)
        left = np.minimum(z.astype(int), count - 1)
        f = z - left
        for shift, weight in zip(range(-1, 3), _weigh_four(f), strict=True):
            np.add.at(weights, (rows, (left + shift) % count), weight)
        return weights
    z = np.clip(z, 0.0, count - 1.0)
    left = np.minimum(z.astype(int), count - 2)
    f = z - left
    before, here, after, beyond = _weigh_four(f)
    begins, ends = left == 0, left == count - 2
    # beyond the outermost knots lies the straight continuation: 2 v0 - v1
    here = here + np.where(begins, 2.0 * before, 0.0) - np.where(ends, beyond, 0.0)
    after = after - np.where(begins, before, 0.0) + np.where(ends, 2.0 * beyond, 0.0)
    np.add.at(weights, (rows, np.maximum(left - 1, 0)), np.where(begins, 0.0, before))
    np.add.at(weights, (rows, left), here)
    np.add.at(weights, (rows, left + 1), after)
    np.add.at(weights, (rows, np.minimum(left + 2, count - 1)), np.where(ends, 0.0, beyond))
    return weights


def _weigh_four(f: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Return the weights of the four knots around a place, a share f of the way between two.

    Catmull and Rom, in Computer Aided Geometric Design (1974): through the knots, with the slope
    of the chord between the neighbours.
    """
    return (
        0.5 * f * (-1.0 + f * (2.0 - f)),
        1.0 + f * f * (-2.5 + 1.5 * f),
        0.5 * f * (1.0 + f * (4.0 - 3.0 * f)),
        0.5 * f * f * (f - 1.0),
    )


def evaluate_law(kind: LawKind, law: Law, at: Floats) -> Floats:
    """Return the curve's values at (n,) places of its variable."""
    curve: Floats = make_curve_matrix(kind, np.array(law.knots), at) @ np.array(law.values)
    return curve
