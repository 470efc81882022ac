"""Pictures of held-out runs: some windows in detail, and the error of every window."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from pendulum_sysid.records import Overlay
from pendulum_sysid.telling.display import format_quantity, format_unit
from pendulum_sysid.telling.svg import (
    AFTER,
    BEFORE,
    MEASURED,
    POINTS,
    STYLE,
    find_largest,
    render_svg,
    thin_out,
)
from pendulum_sysid.telling.window_list import compute_rmse
from pendulum_sysid.verdict.look import PALE, SOFT, keep_drawable_on_log_scale
from pendulum_twin.arrays import Floats, Ints, Mask

WINDOWS = 6  # windows that are drawn in detail
# Fixed margins: a layout that measures every label draws each picture three times.
PANEL_MARGINS = {"left": 0.2, "right": 0.95, "bottom": 0.16, "top": 0.91, "hspace": 0.14}
ERROR_MARGINS = {"left": 0.14, "right": 0.98, "bottom": 0.2, "top": 0.86}
LABEL_X = -0.21  # of the width of the axes, where the label of the y axis stands


def draw_windows(overlay: Overlay) -> list[str]:
    """Return a picture of each of up to six windows: the runs above, their errors below.

    The windows are spread over the recording. All pictures come from one figure, whose lines are
    moved: new axes take longer than all else.
    """
    chosen = spread_windows(overlay.times_s)
    if not chosen.size:
        return []
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(3.6, 2.5))
        runs, errors = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        figure.subplots_adjust(**PANEL_MARGINS)
        _prepare_axes(runs, errors, f"{overlay.channel} ({format_unit(overlay.unit)})")
        run_lines = [runs.plot([], [], **look)[0] for look in (MEASURED, BEFORE, AFTER)]
        error_lines = [errors.plot([], [], **look)[0] for look in (BEFORE, AFTER)]
        pictures = []
        for k in chosen.tolist():
            t, measured, before, after = _take_window(overlay, k)
            seconds = f"{t[0]:.1f} to {t[-1]:.1f} s"
            runs.set_title(seconds)
            _show_runs(runs, run_lines, t, measured, before, after, overlay.unit)
            _show_errors(errors, error_lines, t, before - measured, after - measured)
            label = f"{overlay.channel} from {seconds}: measured, before and after"
            pictures.append(render_svg(figure, f"{overlay.channel}-{k}", label))
    return pictures


def draw_errors(overlay: Overlay, intervals_s: Sequence[Sequence[float]]) -> str:
    """Return the error of every window over the time of the recording.

    intervals_s: stretches that are hatched.
    """
    times, before, after = compute_window_errors(overlay)
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(4.4, 2.1))
        axes = figure.add_subplot()
        figure.subplots_adjust(**ERROR_MARGINS)
        for begin, end in intervals_s:
            axes.axvspan(begin, end, facecolor="none", edgecolor=PALE, hatch="////", linewidth=0)
        before, after = keep_drawable_on_log_scale(before), keep_drawable_on_log_scale(after)
        axes.plot(times, before, marker="o", markersize=3.5, markerfacecolor="white", **BEFORE)
        axes.plot(times, after, marker="o", markersize=3, **AFTER)
        if np.any(np.isfinite([before, after])):
            _set_log_scale(axes)
        axes.set_title(
            f"{overlay.channel}: error of each held-out window ({format_unit(overlay.unit)})"
        )
        axes.set_xlabel("time in the recording (s)")
        axes.grid(axis="y", color=PALE, linewidth=0.3)
        label = f"Error of the {overlay.channel} in every held-out window"
        return render_svg(figure, f"error-{overlay.channel}", label)


def spread_windows(times_s: Floats, most: int = WINDOWS) -> Ints:
    """Return the indices of up to `most` windows, in order of time and spread over the record.

    times_s: (windows, n) s.
    """
    if not np.size(times_s):
        return np.empty(0, dtype=np.int64)
    order = np.argsort(times_s[:, 0], kind="stable")
    return order[thin_out(len(order), most)]


def compute_window_errors(overlay: Overlay) -> tuple[Floats, Floats, Floats]:
    """Return middle (s) and root mean square errors before and after of windows, by time."""
    order = spread_windows(overlay.times_s, 2 * POINTS)
    middle_s = overlay.times_s[order].mean(axis=-1)
    before, after = (
        compute_rmse(run[order], overlay.measured[order])
        for run in (overlay.before, overlay.after)
    )
    return middle_s, before, after


def compute_frame(measured: Floats, after: Floats) -> tuple[float, float]:
    """Return the limits of the y axis: all that is measured, and the run after if it is near."""
    finite = measured[np.isfinite(measured)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    span = max(high - low, 1e-6 + 1e-3 * max(abs(low), abs(high)))
    near = np.clip(after[np.isfinite(after)], low - span, high + span)
    low, high = min([low, *near]), max([high, *near])
    margin = 0.15 * max(high - low, span)
    return low - margin, high + margin


def _take_window(overlay: Overlay, k: int) -> list[Floats]:
    """Return times, measured values and both runs of a window, thinned out."""
    thin = thin_out(overlay.times_s.shape[1])
    arrays = (overlay.times_s, overlay.measured, overlay.before, overlay.after)
    return [np.asarray(values, dtype=float)[k, thin] for values in arrays]


def _prepare_axes(runs: Axes, errors: Axes, label: str) -> None:
    runs.set_ylabel(label)
    errors.set_ylabel("error")
    errors.set_xlabel("time (s)")
    errors.axhline(0, color=SOFT, linewidth=0.5)
    runs.xaxis.set_major_locator(MaxNLocator(4))
    runs.yaxis.set_major_locator(MaxNLocator(4))
    errors.yaxis.set_major_locator(MaxNLocator(2, symmetric=True))
    for axes in (runs, errors):
        axes.yaxis.set_label_coords(LABEL_X, 0.5)


def _show_runs(
    axes: Axes,
    lines: list[Any],
    t: Floats,
    measured: Floats,
    before: Floats,
    after: Floats,
    unit_name: str,
) -> None:
    low, high = compute_frame(measured, after)
    shown = (measured, _keep_near(before, low, high), _keep_near(after, low, high))
    for line, values in zip(lines, shown, strict=True):
        line.set_data(t, values)
    axes.set_xlim(t[0], max(t[-1], t[0] + 1e-6))
    axes.set_ylim(low, high)
    far = np.any(_is_outside(before, low, high))
    errors = (before - measured)[~np.isnan(measured)]
    note = f"before: up to {_describe_worst(errors, unit_name)} off" if far else ""
    axes.set_title(note, loc="right", fontsize=7.5)


def _show_errors(axes: Axes, lines: list[Any], t: Floats, before: Floats, after: Floats) -> None:
    largest = max(4 * find_largest(after), 1e-9)
    limit = 1.1 * min(largest, max(find_largest(before), find_largest(after), 1e-9))
    for line, values in zip(lines, (before, after), strict=True):
        line.set_data(t, _keep_near(values, -limit, limit))
    axes.set_ylim(-limit, limit)


def _set_log_scale(axes: Axes) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0), numticks=9))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())


def _describe_worst(errors: Floats, unit_name: str) -> str:
    finite = np.all(np.isfinite(errors))
    return format_quantity(find_largest(errors), unit_name, 2) if finite else "infinitely far"


def _keep_near(values: Floats, low: float, high: float) -> Floats:
    """Return values without huge numbers: a run that diverges ends at the edge of its frame."""
    room = 5 * (high - low)
    return np.clip(np.where(np.isfinite(values), values, np.nan), low - room, high + room)


def _is_outside(values: Floats, low: float, high: float) -> Mask:
    return ~((values >= low) & (values <= high))
