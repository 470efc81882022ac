"""The proof's pictures as inline SVG: estimation errors on a line, scores against scores."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from pendulum_sysid.telling.svg import STYLE, render_svg
from pendulum_sysid.verdict.look import ACCENT, INK, PALE, SOFT

STRIP_IN = (2.7, 0.24)
SQUARE_IN = (3.2, 3.2)
MARGIN = 1.2  # factor by which the axes of a scatter go beyond its points
DOT: dict[str, Any] = {
    "marker": "o",
    "linestyle": "none",
    "markersize": 4.5,
    "markerfacecolor": ACCENT,
    "markeredgecolor": "none",
    "alpha": 0.55,
}
RING: dict[str, Any] = {
    "marker": "o",
    "linestyle": "none",
    "markersize": 4.5,
    "markerfacecolor": "white",
    "markeredgecolor": INK,
}


def draw_strip(values: Sequence[float], half_range: float, key: str, label: str) -> str:
    """Return signed values as dots on a line; empty for no values.

    values: values beyond the range stand at its edge as rings.
    half_range: value at the right edge, in the values' unit; 0 is in the middle.
    key: beginning of the ids in the picture, unique on the page.
    label: what the picture shows, for a screen reader.
    """
    if not values:
        return ""
    ratios = np.nan_to_num(np.asarray(values, dtype=float) / half_range, posinf=2.0, neginf=-2.0)
    beyond = np.abs(ratios) > 1.0
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=STRIP_IN)
        axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(-1.06, 1.06), ylim=(-1.0, 1.0))
        axes.set_axis_off()
        axes.plot([-1.0, 1.0], [0.0, 0.0], color=PALE, linewidth=0.8)
        axes.plot([0.0, 0.0], [-0.8, 0.8], color=SOFT, linewidth=0.8)
        axes.plot(ratios[~beyond], np.zeros((~beyond).sum()), **DOT)
        axes.plot(np.sign(ratios[beyond]), np.zeros(beyond.sum()), clip_on=False, **RING)
        return render_svg(figure, key, label)


def draw_scatter(
    points: Sequence[tuple[float, float]], x_label: str, y_label: str, factor: float, key: str
) -> str:
    """Return points on logarithmic axes with the line y = x; empty for no point above 0.

    factor: of the dashed line y = factor * x.
    key: beginning of the ids in the picture, unique on the page.
    """
    drawn = np.array([p for p in points if min(p) > 0 and np.isfinite(p).all()])
    if not drawn.size:
        return ""
    ends = np.array([drawn.min() / MARGIN, drawn.max() * MARGIN])
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=SQUARE_IN, layout="constrained")
        axes = figure.subplots(subplot_kw={"xscale": "log", "yscale": "log"})
        axes.plot(ends, ends, color=SOFT, linewidth=0.8)
        axes.plot(ends, factor * ends, color=INK, linewidth=0.8, linestyle="--")
        axes.plot(drawn[:, 0], drawn[:, 1], **DOT)
        axes.set(xlim=ends, ylim=ends, aspect="equal", xlabel=x_label, ylabel=y_label)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
            axis.set_minor_locator(NullLocator())
        return render_svg(figure, key, f"{y_label} against {x_label}")
