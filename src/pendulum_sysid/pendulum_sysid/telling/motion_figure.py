"""The picture of a whole recording, for paper and for readers without scripts."""

from __future__ import annotations

from collections.abc import Sequence

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pendulum_sysid.telling.display import format_unit
from pendulum_sysid.telling.report_data import list_tracks, thin_motion
from pendulum_sysid.telling.svg import STYLE, render_svg
from pendulum_sysid.telling.window_list import HELD_OUT, WindowRow
from pendulum_sysid.verdict.drawn import Motion
from pendulum_sysid.verdict.look import ACCENT, PALE

MARGINS = {"left": 0.09, "right": 0.99, "top": 0.98, "hspace": 0.18}
LINE = {"color": ACCENT, "linewidth": 0.7}
POINTS = 1000  # of a track
TRACK_INCHES = 1.0
MOST_BANDS = 400  # held-out windows that are shaded


def draw_motion(motion: Motion, rows: Sequence[WindowRow]) -> str:
    """Return the tracks of a recording below each other; held-out windows are shaded.

    Ticks at the bottom mark samples that were left out; hatched stretches hold no samples.
    """
    tracks = list_tracks(motion)
    chosen = thin_motion(motion, POINTS)
    with matplotlib.style.context(["default", STYLE]):
        height = TRACK_INCHES * len(tracks) + 0.45
        figure = Figure(figsize=(9.0, height))
        panels = np.atleast_1d(figure.subplots(len(tracks), 1, sharex=True))
        figure.subplots_adjust(bottom=0.42 / height, **MARGINS)
        for k, ((name, title, unit), axes) in enumerate(zip(tracks, panels, strict=True)):
            at = chosen if chosen.ndim == 1 else chosen[k]
            axes.plot(motion.times_s[at], getattr(motion, name)[at], **LINE)
            axes.set_ylabel(f"{title}\n({format_unit(unit)})" if unit else title, fontsize=7)
            _mark(axes, motion, rows)
        panels[-1].set_xlabel("time (s)")
        return render_svg(figure, "motion", "The whole recording: " + ", ".join(
            title for _, title, _ in tracks
        ))  # fmt: skip


def _mark(axes: Axes, motion: Motion, rows: Sequence[WindowRow]) -> None:
    axes.margins(x=0)
    held_out = [(r.begin_s, r.end_s - r.begin_s) for r in rows if r.purpose == HELD_OUT]
    bottom = axes.get_xaxis_transform()
    if 0 < len(held_out) <= MOST_BANDS:
        axes.broken_barh(
            held_out, (0, 1), transform=bottom, facecolor=PALE, alpha=0.35, linewidth=0
        )
    for begin, end in motion.breaks_s:
        axes.axvspan(begin, end, facecolor="none", edgecolor=PALE, hatch="////", linewidth=0)
    marks = motion.left_out_s[:POINTS]
    axes.plot(marks, np.zeros(len(marks)), "|", color="#b3261e", markersize=5, transform=bottom)
