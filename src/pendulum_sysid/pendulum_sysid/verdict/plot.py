"""The verdict as a figure: held-out runs before and after, and the shape of what is missing."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pendulum_sysid.records import Evidence, Overlay
from pendulum_sysid.verdict.look import ACCENT, INK, keep_drawable
from pendulum_sysid.verdict.record import Verdict

WINDOWS = 3  # held-out windows drawn a joint, spread over the recording
MARGIN = 0.5  # of the measured range: a run that leaves it is cut off


def plot_verdict(verdict: Verdict) -> Figure:
    """Return the figure of a verdict: a row a joint, and a row of measured shapes.

    A verdict that was read from a file holds no runs: its figure says so.
    """
    shapes = [
        evidence
        for evidence in (verdict.localisation.evidence if verdict.localisation else ())
        if len(evidence.shape_x) > 1
    ][:WINDOWS]
    rows = len(verdict.overlays) + bool(shapes)
    figure = Figure(figsize=(9.0, 2.6 * max(rows, 1)), layout="constrained")
    if not rows:
        figure.suptitle("This verdict holds no runs to draw.")
        return figure
    panels = figure.subplots(rows, WINDOWS, squeeze=False)
    for overlay, row in zip(verdict.overlays, panels, strict=False):
        _draw_overlay(row, overlay)
    for axes in panels[-1][len(shapes) :] if shapes else ():
        axes.set_axis_off()
    for evidence, axes in zip(shapes, panels[-1], strict=False):
        _draw_shape(axes, evidence)
    panels[0][0].legend(fontsize="small")
    return figure


def _draw_overlay(row: np.ndarray, overlay: Overlay) -> None:
    chosen = np.linspace(0, len(overlay.times_s) - 1, len(row)).round().astype(int)
    for axes, k in zip(row, chosen, strict=True):
        t, measured = overlay.times_s[k], overlay.measured[k]
        axes.plot(t, measured, color="0.7", linewidth=4, label="measured")
        axes.plot(t, keep_drawable(overlay.before[k]), color=INK, ls="--", label="before")
        axes.plot(t, keep_drawable(overlay.after[k]), color=ACCENT, label="after")
        low, high = np.nanmin(measured), np.nanmax(measured)
        room = MARGIN * (high - low) or 1e-6
        axes.set_ylim(low - room, high + room)
        axes.set_xlabel("time (s)")
    row[0].set_ylabel(f"{overlay.channel} ({overlay.unit})")


def _draw_shape(axes: Axes, evidence: Evidence) -> None:
    order = np.argsort(evidence.shape_x)
    x, y = evidence.shape_x[order], evidence.shape_y[order]
    if evidence.shape_band.shape == evidence.shape_y.shape:
        band = evidence.shape_band[order]
        axes.fill_between(x, y - band, y + band, color=ACCENT, alpha=0.15, linewidth=0)
    axes.plot(x, y, color=ACCENT, marker=".")
    axes.axhline(0.0, color="0.7", linewidth=0.6)
    axes.set_xlabel(evidence.shape_axis or evidence.variable)
    axes.set_ylabel(f"{evidence.shape_of} ({evidence.shape_unit})".replace(" ()", ""))
