"""The course of a size over time as a picture: estimates, intervals, pieces, next week."""

from __future__ import annotations

from datetime import timedelta

import matplotlib.style
import numpy as np
from markupsafe import Markup
from matplotlib.figure import Figure

from pendulum_sysid import decisions
from pendulum_sysid.fleet.history import PRESENCE, WEEK_S, Size
from pendulum_sysid.telling.svg import STYLE, render_svg, thin_out
from pendulum_sysid.verdict.look import ACCENT, INK, PALE, SOFT
from pendulum_twin.arrays import Floats

HOUR_S, DAY_S = 3600.0, 86_400.0
SHOWN_AHEAD = 0.25  # of the history, at which a forecast may be drawn
ROOM = 0.1  # of the estimates' range, above and below them


def draw_course(size: Size, key: str) -> Markup:
    """Return a picture of the size over time, hours or days since the first recording.

    key: unique on the page.
    """
    rows = size.rows
    stamps = rows["time"].map(lambda time: time.timestamp()).to_numpy(float)
    unit_s, unit = (
        (HOUR_S, "hours")
        if np.ptp(stamps) < timedelta(days=3).total_seconds()
        else (
            DAY_S,
            "days",
        )
    )
    times = (stamps - stamps[0]) / unit_s
    values, errors = (rows[name].to_numpy(float) for name in ("value", "error"))
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(6.4, 2.3), layout="constrained")
        axes = figure.add_subplot()
        chosen = thin_out(len(times), 400)
        halves = decisions.INTERVAL_DEVIATIONS * errors
        bars = 0.0 if size.parameter == PRESENCE else halves[chosen]
        axes.errorbar(
            times[chosen], values[chosen], yerr=bars, fmt="o", markersize=2.4, color=INK,
            ecolor=PALE, elinewidth=1.2, zorder=2,
        )  # fmt: skip
        for piece in size.course.pieces:
            ends = stamps[[piece.begin, piece.end - 1]]
            axes.plot(
                (ends - stamps[0]) / unit_s, [piece.predict(s) for s in ends], color=ACCENT,
                linewidth=2.0, zorder=3,
            )  # fmt: skip
        for change in size.course.changes:
            axes.axvspan(times[change.earliest], times[change.latest], color=ACCENT, alpha=0.15)
        if SHOWN_AHEAD * 4 * np.ptp(stamps) > WEEK_S and size.parameter != PRESENCE:
            value, low, high = size.next_week
            ahead = times[-1] + WEEK_S / unit_s
            axes.errorbar(
                [ahead], [value], yerr=[[value - low], [high - value]], fmt="D", markersize=3.5,
                color=ACCENT, ecolor=ACCENT, elinewidth=1.2,
            )  # fmt: skip
        _limit_height(axes, values, halves)
        axes.set_xlabel(f"{unit} since the first recording", color=SOFT)
        axes.set_ylabel(size.unit or "named")
        label = f"{size.name} over time, {len(rows)} recordings"
        return Markup(render_svg(figure, key, label))


def _limit_height(axes: object, values: Floats, halves: Floats) -> None:
    """Let the estimates fill the picture, however long the widest bars are."""
    low, high = float(values.min()), float(values.max())
    reach = max(high - low, 1e-12)
    margin = ROOM * reach + min(float(np.median(halves)), reach)
    axes.set_ylim(low - margin, high + margin)  # type: ignore[attr-defined]
