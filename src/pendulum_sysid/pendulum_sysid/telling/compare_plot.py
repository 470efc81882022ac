"""Draw two twins on one recording: the runs in some windows, and the error of every window."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pendulum_sysid.errors import WrongUse
from pendulum_sysid.fitting.window_runs import JOINTS, UNITS, WindowRuns
from pendulum_sysid.telling.output_files import write_bytes
from pendulum_sysid.verdict.look import ACCENT, INK, keep_drawable

SHOWN = 4  # windows drawn in full
FORMATS = (".png", ".svg", ".pdf")
MEASURED: dict[str, Any] = {"color": "0.7", "linewidth": 4.0}
STYLES: tuple[dict[str, Any], ...] = (
    {"color": INK, "linewidth": 1.2, "linestyle": "--"},
    {"color": ACCENT, "linewidth": 1.4},
)
MARGIN = 0.5  # of the measured range, above and below it: a run that leaves is cut off there


def check_format(path: Path) -> None:
    """Raise WrongUse unless the name ends like a picture that can be drawn."""
    if path.suffix.lower() not in FORMATS:
        ending = path.suffix or "no ending"
        raise WrongUse(
            f"{path}: expected a picture's name ending in {' or '.join(FORMATS)}, found {ending}"
        )


def draw_comparison(
    path: Path, title: str, names: tuple[str, str], runs: tuple[WindowRuns, WindowRuns]
) -> None:
    """Write the picture whole or not at all.

    path: png, svg or pdf by its ending.
    names, runs: of the two twins, on the same windows.

    Raises BadInputError when the picture cannot be written.
    """
    check_format(path)
    first = runs[0]
    figure = Figure(figsize=(12.0, 5.5 * len(first.channels)), layout="constrained")
    figure.suptitle(title)
    rows = figure.subfigures(2 * len(first.channels), 1, squeeze=False)[:, 0]
    shown = np.unique(np.linspace(0, len(first) - 1, SHOWN).round().astype(int))
    for k, joint in enumerate(first.channels):
        label = f"{JOINTS[joint]} ({UNITS[joint]})"
        panels = rows[2 * k].subplots(1, len(shown), squeeze=False)[0]
        for axes, window in zip(panels, shown, strict=True):
            _draw_window(axes, int(window), k, names, runs)
        panels[0].set_ylabel(label)
        _draw_errors(rows[2 * k + 1].subplots(), k, f"error of {label}", names, runs)
    stream = io.BytesIO()
    figure.savefig(stream, format=path.suffix.lower()[1:], dpi=120)
    write_bytes(path, stream.getvalue())


def _draw_window(
    axes: Axes,
    window: int,
    channel: int,
    names: tuple[str, str],
    runs: tuple[WindowRuns, WindowRuns],
) -> None:
    first = runs[0]
    times = first.begin_s[window] + first.period_s * np.arange(first.measured.shape[1])
    counts = first.counts[window, :, channel] > 0.0
    measured = np.where(counts, first.measured[window, :, channel], np.nan)
    axes.plot(times, measured, label="measured", **MEASURED)
    for name, run, style in zip(names, runs, STYLES, strict=True):
        axes.plot(times, keep_drawable(run.runs[window, :, channel]), label=name, **style)
    low, high = np.nanmin(measured), np.nanmax(measured)
    room = MARGIN * (high - low) or 1e-6
    axes.set_ylim(low - room, high + room)
    axes.set_xlabel("time (s)")
    if window == 0:
        axes.legend(fontsize="small")


def _draw_errors(
    axes: Axes,
    channel: int,
    label: str,
    names: tuple[str, str],
    runs: tuple[WindowRuns, WindowRuns],
) -> None:
    for name, run, style in zip(names, runs, STYLES, strict=True):
        axes.plot(
            run.begin_s,
            keep_drawable(run.window_rmse[:, channel]),
            marker=".",
            label=name,
            **style,
        )
    axes.axhline(runs[0].noise[channel], color="0.7", label="noise of the sensor")
    axes.set_yscale("log")
    axes.set_xlabel("start of the window (s)")
    axes.set_ylabel(label)
    axes.legend(fontsize="small")
