"""The picture of a measured shape: what is missing, against one variable."""

from __future__ import annotations

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pendulum_sysid.records import Evidence
from pendulum_sysid.telling.svg import AFTER, STYLE, render_svg, thin_out
from pendulum_sysid.verdict.look import ACCENT, SOFT
from pendulum_twin.arrays import Floats

MARGINS = {"left": 0.17, "right": 0.98, "bottom": 0.19, "top": 0.96}
MOST_MARKED = 40  # points of a curve up to which each has a marker


def draw_shape(evidence: Evidence, key: str, x_label: str, y_label: str) -> str:
    """Return the measured curve with its 95 % band; "" for evidence that is a single number."""
    if not len(evidence.shape_x):
        return ""
    order = np.argsort(evidence.shape_x, kind="stable")
    order = order[thin_out(len(order))]
    x, y = evidence.shape_x[order], evidence.shape_y[order]
    has_band = evidence.shape_band.shape == evidence.shape_y.shape
    band = evidence.shape_band[order] if has_band else np.zeros_like(y)
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(4.4, 2.4))
        axes = figure.add_subplot()
        figure.subplots_adjust(**MARGINS)
        axes.axhline(0, color=SOFT, linewidth=0.6)
        if has_band:
            _draw_band(axes, x, y - band, y + band)
        axes.plot(x, y, marker="o" if x.size <= MOST_MARKED else "", markersize=2.5, **AFTER)
        if np.all(np.isfinite([y, band])):
            axes.set_ylim(*_compute_frame(y, band))
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        return render_svg(figure, key, f"{y_label} against {x_label}")


def _draw_band(axes: Axes, x: Floats, low: Floats, high: Floats) -> None:
    axes.fill_between(x, low, high, facecolor=ACCENT, alpha=0.15, linewidth=0)
    for edge in (low, high):
        axes.plot(x, edge, color=ACCENT, linewidth=0.5, linestyle=":")


def _compute_frame(y: Floats, band: Floats) -> tuple[float, float]:
    """Return the limits of the y axis: a band that is wide where little is measured leaves it."""
    span = max(float(np.ptp([0.0, *y])), 1e-12)
    room = np.minimum(band, 0.5 * span)
    low, high = min(0.0, float(np.min(y - room))), max(0.0, float(np.max(y + room)))
    return low - 0.05 * span, high + 0.05 * span
