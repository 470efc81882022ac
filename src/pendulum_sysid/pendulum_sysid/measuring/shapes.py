"""Shapes that a measured curve may have: formulas that are linear in some of their parameters."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pendulum_twin.arrays import Floats

SHARPEST = 1e-12  # width of an edge
FASTEST = 0.02  # of the range; length of a settling
PLACES = ("centre", "place")  # parameters of shapes that say where
LARGEST = 1e6  # of a column; an exponential beyond it is no curve between knots

# From places (n,) and the parameters that say where or how, to columns (n, k).
ColumnMaker = Callable[..., Floats]


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
    two_sided: True where the first two factors are of the curve before and behind `place`.
    edge: True for a curve that goes from a constant to another at `place`, within some `width`.
    parts: factors of the parts of a sum; each part has to be there. Empty for a single part.
    powers: of the variable's unit, by which the unit of a factor is divided; 0 where not listed.
    """

    name: str
    text: str
    columns: ColumnMaker
    factors: tuple[str, ...]
    more: tuple[str, ...] = ()
    starts: Callable[[float, float, int], tuple[tuple[float, ...], ...]] = lambda *_: ()
    words: str = ""
    two_sided: bool = False
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
        two_sided=True,
        edge=True,
    ),
    Shape(
        "bend",
        "{offset} + {before} min(x - {place}, 0) + {behind} max(x - {place}, 0)",
        lambda x, place: _stack(np.minimum(x - place, 0), np.maximum(x - place, 0), _ones(x)),
        ("before", "behind", "offset"),
        ("place",),
        lambda low, span, count: (_grid_centres(low, span),),
        words="is {offset} at {place}, and changes by {before} for each {x} before it and by "
        "{behind} behind it",
        two_sided=True,
        powers={"before": 1, "behind": 1},
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
TIME_SHAPES: tuple[Shape, ...] = tuple(s for s in SHAPES if s.name not in ("bump", "step", "bend"))
# The gain of a drive has one law over time, and several causes: a battery recovers while the
# supply swings.
GAIN_TIME_SHAPES: tuple[Shape, ...] = (*TIME_SHAPES, SETTLING_WAVE)
# Teeth and ripples come again along the rail and in time, and nothing does along a velocity.
SPEED_SHAPES: tuple[Shape, ...] = tuple(s for s in SHAPES if s.name != "wave")
