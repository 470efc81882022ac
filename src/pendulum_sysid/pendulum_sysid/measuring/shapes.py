"""Shapes that a measured curve may have, and the fit of a shape to a curve with its band.

A shape is linear in some of its parameters: for every start of the others these follow by least
squares (variable projection; Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413), and the best
start is refined.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from pendulum_twin.arrays import Floats

SHARPEST = 1e-12  # width of an edge
FASTEST = 0.02  # of the range; length of a settling
PLACES = ("centre", "place")  # parameters of shapes that say where
LARGEST = 1e6  # of a column; an exponential beyond it is no curve between knots

# From places (n,) and the parameters that say where or how, to columns (n, k).
Columns = Callable[..., Floats]


@dataclass(frozen=True)
class Shape:
    """Describe a shape: the sum of columns, each with a factor.

    name: for a person.
    text: formula with x for the variable and the parameters in braces.
    columns: makes the columns.
    factors: names of their factors.
    more: names of the other parameters.
    starts: of each of these; made from the lowest place, the range and the number of places.
    words: what the curve does, for a person, with the parameters in braces and {x}, the unit of
        the variable: a growth is said for a step of this unit.
    edge: True for a curve that goes from a constant to another at `place`, within some `width`.
    parts: factors of the parts of a sum; each part has to be there. Empty for a single part.
    powers: of the variable's unit, by which the unit of a factor is divided; 0 where not listed.
    """

    name: str
    text: str
    columns: Columns
    factors: tuple[str, ...]
    more: tuple[str, ...] = ()
    starts: Callable[[float, float, int], tuple[tuple[float, ...], ...]] = lambda *_: ()
    words: str = ""
    edge: bool = False
    parts: tuple[tuple[str, ...], ...] = ()
    powers: Mapping[str, int] = field(default_factory=dict)

    def draw_columns(self, x: Floats, more: Sequence[float] | Floats) -> Floats:
        """Return the columns (n, factors) at places (n,); bounded for all parameters."""
        with np.errstate(all="ignore"):
            columns = np.nan_to_num(self.columns(x, *more), nan=0.0)
        return np.clip(columns, -LARGEST, LARGEST)


def _stack(*columns: Floats) -> Floats:
    return np.stack(np.broadcast_arrays(*columns), axis=1)


def _ones(x: Floats) -> Floats:
    return np.ones_like(x)


def _draw_sides(widths: Floats) -> Floats:
    """Return the columns of what holds before an edge and behind it, so many widths from it."""
    behind = 1.0 / (1.0 + np.exp(-np.clip(widths, -60, 60)))
    return _stack(1.0 - behind, behind)


def _settle(x: Floats, length: float) -> Floats:
    """Return what is left of 1 after places (n,); faster would be an event of the beginning."""
    return np.exp(-(x - x.min()) / max(length, FASTEST * float(np.ptp(x))))


def _grid_centres(low: float, span: float) -> tuple[float, ...]:
    return tuple(low + span * np.linspace(0.05, 0.95, 13))


def _grid_periods(span: float, count: int) -> tuple[float, ...]:
    """Return periods half a wave in the range apart, down to two and a half places a wave."""
    return tuple(span / np.arange(1.0, max(count / 2.5, 1.5), 0.5))


def _draw_wave(x: Floats, period: float) -> tuple[Floats, Floats]:
    """Return sine and cosine; what does not come round within the range is no wave."""
    turns = x / min(period, float(np.ptp(x)))
    return np.sin(2 * np.pi * turns), np.cos(2 * np.pi * turns)


SHAPES: tuple[Shape, ...] = (
    Shape("constant", "{offset}", lambda x: _stack(_ones(x)), ("offset",), words="is {offset}"),
    Shape(
        "line",
        "{offset} + {slope} x",
        lambda x: _stack(_ones(x), x),
        ("offset", "slope"),
        words="is {offset}, and changes by {slope} for each {x}",
        powers={"slope": 1},
    ),
    Shape(
        "square",
        "{offset} + {factor} x^2",
        lambda x: _stack(_ones(x), x * x),
        ("offset", "factor"),
        words="is {offset}, and grows with the square, by {factor} at 1 {x}",
        powers={"factor": 2},
    ),
    Shape(
        "signed square",
        "{offset} + {factor} x |x|",
        lambda x: _stack(_ones(x), x * np.abs(x)),
        ("offset", "factor"),
        words="is {offset}, and grows with the square and its sign, by {factor} at 1 {x}",
        powers={"factor": 2},
    ),
    Shape(
        "cube",
        "{offset} + {factor} x^3",
        lambda x: _stack(_ones(x), x**3),
        ("offset", "factor"),
        words="is {offset}, and grows with the cube, by {factor} at 1 {x}",
        powers={"factor": 3},
    ),
    Shape(
        "line and cube",
        "{slope} x + {factor} x^3",
        lambda x: _stack(x, x**3),
        ("slope", "factor"),
        words="grows by {slope} for each {x}, and with the cube by {factor} at 1 {x}",
        powers={"slope": 1, "factor": 3},
    ),
    Shape(
        "size",
        "{offset} + {factor} |x|",
        lambda x: _stack(_ones(x), np.abs(x)),
        ("offset", "factor"),
        words="is {offset}, and grows by {factor} for each {x} to either side",
        powers={"factor": 1},
    ),
    Shape(
        "exponential",
        "{offset} + {factor} exp(-(x - x0) / {length})",
        lambda x, length: _stack(_ones(x), np.exp(-(x - x.min()) / length)),
        ("offset", "factor"),
        ("length",),
        lambda low, span, count: (tuple(span * np.array([0.1, 0.3, 1.0, -0.3, -1.0])),),
        words="tends to {offset}, {factor} away at first, over {length}",
    ),
    Shape(
        "bump",
        "{offset} + {factor} exp(-((x - {centre}) / {width})^2)",
        lambda x, centre, width: _stack(_ones(x), np.exp(-(((x - centre) / width) ** 2))),
        ("offset", "factor"),
        ("centre", "width"),
        lambda low, span, count: (
            _grid_centres(low, span),
            tuple(span * np.array([0.05, 0.12, 0.3])),
        ),
        words="is {offset}, and {factor} more near {centre}, over {width} to either side",
    ),
    Shape(
        "step",
        "{before} (1 - s) + {behind} s, s = 1 / (1 + exp(-(x - {place}) / {width}))",
        lambda x, place, width: _draw_sides((x - place) / max(abs(width), SHARPEST)),
        ("before", "behind"),
        ("place", "width"),
        lambda low, span, count: (_grid_centres(low, span), tuple(span * np.array([0.005, 0.03]))),
        words="is {before} before {place} and {behind} behind it",
        edge=True,
    ),
    Shape(
        "saturation",
        "{offset} + {factor} tanh(x / {width})",
        lambda x, width: _stack(_ones(x), np.tanh(x / width)),
        ("offset", "factor"),
        ("width",),
        lambda low, span, count: (tuple(span * np.array([0.03, 0.1, 0.3])),),
        words="is {offset}, and rises by {factor} to either side, within {width}",
    ),
    Shape(
        "wave",
        "{offset} + {sine} sin(2 pi x / {period}) + {cosine} cos(2 pi x / {period})",
        lambda x, period: _stack(_ones(x), *_draw_wave(x, period)),
        ("offset", "sine", "cosine"),
        ("period",),
        lambda low, span, count: (_grid_periods(span, count),),
        words="repeats every {period} ({sine} of the sine, {cosine} of the cosine) about {offset}",
    ),
)


def _make_turn_shape(harmonic: int) -> Shape:
    often = "once" if harmonic == 1 else f"{harmonic} times"
    return Shape(
        "wave of a turn" if harmonic == 1 else f"wave of a turn, {harmonic} times",
        f"{{offset}} + {{sine}} sin({harmonic} x) + {{cosine}} cos({harmonic} x)",
        lambda x: _stack(_ones(x), np.sin(harmonic * x), np.cos(harmonic * x)),
        ("offset", "sine", "cosine"),
        words=f"repeats {often} a turn ({{sine}} of the sine, {{cosine}} of the cosine) about "
        "{offset}",
    )


TURN_SHAPES: tuple[Shape, ...] = (SHAPES[0], *(_make_turn_shape(k) for k in (1, 2, 3, 4)))
SETTLING_WAVE = Shape(
    "exponential and wave",
    "{offset} + {factor} exp(-(x - x0) / {length}) "
    "+ {sine} sin(2 pi x / {period}) + {cosine} cos(2 pi x / {period})",
    lambda x, length, period: _stack(_ones(x), _settle(x, length), *_draw_wave(x, period)),
    ("offset", "factor", "sine", "cosine"),
    ("length", "period"),
    lambda low, span, count: (tuple(span * np.array([0.1, 0.3])), _grid_periods(span, count)),
    words="tends to {offset}, {factor} away at first, over {length}, and repeats every {period} "
    "({sine} of the sine, {cosine} of the cosine) beside that",
    parts=(("factor",), ("sine", "cosine")),
)
# An event at an instant happens in a recording; the rig does not repeat it in the next.
TIME_SHAPES: tuple[Shape, ...] = tuple(s for s in SHAPES if s.name not in ("bump", "step"))
# The gain of a drive has one law over time, and several causes: a battery recovers while the
# supply swings.
GAIN_TIME_SHAPES: tuple[Shape, ...] = (*TIME_SHAPES, SETTLING_WAVE)
# Teeth and ripples come again along the rail and in time, and nothing does along a velocity.
SPEED_SHAPES: tuple[Shape, ...] = tuple(s for s in SHAPES if s.name != "wave")


@dataclass(frozen=True)
class FittedShape:
    """Hold a shape with its parameters.

    values: (parameters,) factors, then the others.
    deviations: (parameters,) their standard deviations.
    curve: (knots,) its values at the knots.
    misfit: sum of squares in units of the curve's own uncertainty.
    """

    shape: Shape
    values: Floats
    deviations: Floats
    curve: Floats
    misfit: float

    @property
    def names(self) -> tuple[str, ...]:
        """Return the names of the parameters."""
        return (*self.shape.factors, *self.shape.more)

    @property
    def cost(self) -> float:
        """Return the misfit with what its parameters may fit by chance (Schwarz, 1978)."""
        return self.misfit + len(self.values) * float(np.log(len(self.curve)))


def fit_shape(shape: Shape, x: Floats, y: Floats, root: Floats) -> FittedShape:
    """Return the shape nearest to a curve.

    x, y: (knots,) the curve.
    root: (k, knots) such that root @ error has independent parts of unit variance.
    """
    low, span = float(x.min()), float(np.ptp(x))
    best: tuple[float, tuple[float, ...]] = (np.inf, ())
    for start in product(*shape.starts(low, span, len(x))):
        misfit = float(np.sum(_solve(shape, x, y, root, start)[1] ** 2))
        best = min(best, (misfit, start), key=lambda pair: pair[0])
    more = np.array(best[1])
    if len(more):
        scale = np.where(more == 0.0, span, np.abs(more))
        refined = least_squares(
            lambda z: _solve(shape, x, y, root, z * scale)[1], more / scale, max_nfev=60
        )
        more = refined.x * scale
    factors, off = _solve(shape, x, y, root, more)
    values = np.concatenate([factors, more])
    curve = shape.draw_columns(x, more) @ factors
    return FittedShape(
        shape,
        values,
        _compute_deviations(shape, x, root, values, float(np.sum(off**2))),
        curve,
        float(np.sum(off**2)),
    )


def _solve(
    shape: Shape, x: Floats, y: Floats, root: Floats, more: Sequence[float] | Floats
) -> tuple[Floats, Floats]:
    """Return the factors and what they leave, in units of uncertainty."""
    weighted = root @ shape.draw_columns(x, more)
    factors = np.linalg.lstsq(weighted, root @ y, rcond=1e-12)[0]
    return factors, root @ y - weighted @ factors


def _compute_deviations(
    shape: Shape, x: Floats, root: Floats, values: Floats, misfit: float
) -> Floats:
    weighted = root @ draw_slopes(shape, x, values)
    spread = np.linalg.pinv(weighted.T @ weighted, rcond=1e-12, hermitian=True)
    wider = max(1.0, misfit / max(len(x) - len(values), 1))
    return np.sqrt(np.maximum(np.diag(spread), 0.0) * wider)


def draw_slopes(shape: Shape, x: Floats, values: Floats) -> Floats:
    """Return how the curve changes with the parameters of its shape, (knots, parameters)."""
    count = len(shape.factors)

    def draw(values: Floats) -> Floats:
        return np.asarray(shape.draw_columns(x, values[count:]) @ values[:count])

    slopes = np.empty((len(x), len(values)))
    for k, value in enumerate(values):
        step = 1e-5 * max(abs(float(value)), 1e-9)
        moved = values.copy()
        moved[k] += step
        slopes[:, k] = (draw(moved) - draw(values)) / step
    return slopes


def rank_shapes(
    shapes: Sequence[Shape], x: Floats, y: Floats, covariance: Floats
) -> list[FittedShape]:
    """Return the shapes fitted to a curve, the most believable first.

    A straight line that ends in a bend is also the flank of a bump five times as far away as the
    curve reaches: a shape whose place was not seen is left out.

    covariance: (knots, knots) of y.
    """
    power, along = np.linalg.eigh(covariance)
    kept = power > 1e-10 * power[-1]
    root = (along[:, kept] / np.sqrt(power[kept])).T
    fitted = [fit_shape(shape, x, y, root) for shape in shapes if len(x) > len(shape.factors) + 2]
    seen = [shape for shape in fitted if is_place_seen(shape, x)]
    return sorted(seen, key=lambda shape: shape.cost)


def is_place_seen(fitted: FittedShape, x: Floats) -> bool:
    """Return whether the middle of a bump or an edge lies on the curve: else nothing shows it."""
    places = [v for n, v in zip(fitted.names, fitted.values, strict=True) if n in PLACES]
    return all(x.min() <= place <= x.max() for place in places)
