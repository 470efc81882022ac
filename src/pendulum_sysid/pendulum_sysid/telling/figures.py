"""The report's pictures as inline SVG: small, the same bytes for the same input, readable without colour."""

from __future__ import annotations

import io
import re
from collections.abc import Sequence
from html import escape
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from pendulum_sysid.records import Evidence, Ints, Overlay
from pendulum_sysid.telling.display import quantity, unit
from pendulum_twin.signals import Floats, Mask

WINDOWS = 6
POINTS = 160  # drawn a line
INK, SOFT, PALE, ACCENT = "#16191d", "#59636e", "#b4bcc5", "#0b5cad"
MEASURED: dict[str, Any] = {"color": PALE, "linewidth": 4.0, "solid_capstyle": "round"}
BEFORE: dict[str, Any] = {"color": INK, "linewidth": 1.1, "linestyle": (0, (3.5, 2.0))}
AFTER: dict[str, Any] = {"color": ACCENT, "linewidth": 1.4}
STYLE = {
    "svg.fonttype": "none",
    "svg.hashsalt": "pendulum",
    "font.family": "DejaVu Sans",  # for the layout: comes with matplotlib; the page's own font replaces it
    "font.size": 8.0,
    "axes.titlesize": 8.5,
    "axes.titlelocation": "left",
    "axes.edgecolor": SOFT,
    "axes.labelcolor": INK,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "xtick.color": SOFT,
    "ytick.color": SOFT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "figure.facecolor": "none",
    "savefig.facecolor": "none",
    "hatch.linewidth": 0.5,
}
NO_METADATA = dict.fromkeys(("Date", "Creator", "Format", "Type"))


def overlay_panels(overlay: Overlay) -> list[str]:
    """Return one picture for each of up to six windows spread over the record: above the runs, below their errors."""
    return [_overlay_panel(overlay, int(k)) for k in spread(overlay.times_s)]


def error_panel(overlay: Overlay, intervals_s: Sequence[Sequence[float]]) -> str:
    """Return the error of every window over the recording's time, the named stretches hatched; "" for no window."""
    times, before, after = window_errors(overlay)
    if not len(times):
        return ""
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(4.4, 2.1), layout="constrained")
        axes = figure.add_subplot()
        for begin, end in intervals_s:
            axes.axvspan(begin, end, facecolor="none", edgecolor=PALE, hatch="////", linewidth=0)
        axes.plot(
            times, _drawable(before), marker="o", markersize=3.5, markerfacecolor="white", **BEFORE
        )
        axes.plot(times, _drawable(after), marker="o", markersize=3, **AFTER)
        if np.any(np.isfinite(_drawable(np.concatenate([before, after])))):
            _log_scale(axes)
        axes.set_title(f"{overlay.channel}: error of each held-out window ({unit(overlay.unit)})")
        axes.set_xlabel("time in the recording (s)")
        axes.grid(axis="y", color=PALE, linewidth=0.3)
        return render_svg(
            figure,
            f"error-{overlay.channel}",
            f"Error of the {overlay.channel} in every held-out window",
        )


def shape_panel(evidence: Evidence, key: str, x_label: str, y_label: str) -> str:
    """Return the measured curve of what is unexplained against one variable, with its band; "" when there is none.

    The evidence's arrays: (n,) each; the band is the half-width of a 95 % interval about the
    curve.
    """
    x, y, band = (
        np.asarray(a, dtype=float)
        for a in (evidence.shape_x, evidence.shape_y, evidence.shape_band)
    )
    if not x.size or x.shape != y.shape or x.ndim != 1:
        return ""
    order = np.argsort(x, kind="stable")
    order = order[thinned(len(order))]
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(4.4, 2.4), layout="constrained")
        axes = figure.add_subplot()
        axes.axhline(0, color=SOFT, linewidth=0.6)
        if band.shape == y.shape:
            low, high = (y - band)[order], (y + band)[order]
            axes.fill_between(x[order], low, high, facecolor=ACCENT, alpha=0.15, linewidth=0)
            for edge in (low, high):
                axes.plot(x[order], edge, color=ACCENT, linewidth=0.5, linestyle=":")
        axes.plot(x[order], y[order], marker="o" if x.size <= 40 else "", markersize=2.5, **AFTER)
        if np.all(np.isfinite(y)) and np.all(np.isfinite(band)):
            axes.set_ylim(*_shape_frame(y, band if band.shape == y.shape else np.zeros_like(y)))
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        return render_svg(figure, key, f"{y_label} against {x_label}")


def _shape_frame(y: Floats, band: Floats) -> tuple[float, float]:
    """Return the lowest and highest value to show of a curve: a band that is wide where little was measured leaves it."""
    span = max(float(np.ptp([0.0, *y])), 1e-12)
    room = np.minimum(band, 0.5 * span)
    low, high = min(0.0, float(np.min(y - room))), max(0.0, float(np.max(y + room)))
    return low - 0.05 * span, high + 0.05 * span


def spread(times_s: Floats, most: int = WINDOWS) -> Ints:
    """Return the indices of up to so many windows, in order of time and evenly spread over the record."""
    if np.ndim(times_s) != 2 or not np.size(times_s):
        return np.empty(0, dtype=np.int64)
    order = np.argsort(times_s[:, 0], kind="stable")
    places = np.unique(np.round(np.linspace(0, len(order) - 1, most)).astype(np.int64))
    return order[places]


def thinned(samples: int, most: int = POINTS) -> Ints:
    """Return the indices of at most so many of the samples, the first and the last among them."""
    return np.unique(np.round(np.linspace(0, samples - 1, min(samples, most))).astype(np.int64))


def window_errors(overlay: Overlay) -> tuple[Floats, Floats, Floats]:
    """Return each window's middle in s and its root mean square errors before and after, in order of time."""
    order = spread(overlay.times_s, 2 * POINTS)
    return (
        np.asarray(overlay.times_s, dtype=float)[order].mean(axis=-1)
        if order.size
        else np.empty(0),
        _rms(overlay.before, overlay.measured)[order] if order.size else np.empty(0),
        _rms(overlay.after, overlay.measured)[order] if order.size else np.empty(0),
    )


def frame(measured: Floats, after: Floats) -> tuple[float, float]:
    """Return the lowest and highest value to show: all that was measured, and the run after unless it is far off."""
    finite = measured[np.isfinite(measured)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    span = max(high - low, 1e-6 + 1e-3 * max(abs(low), abs(high)))
    near = np.clip(after[np.isfinite(after)], low - span, high + span)
    low, high = min([low, *near]), max([high, *near])
    margin = 0.15 * max(high - low, span)
    return low - margin, high + margin


def _overlay_panel(overlay: Overlay, k: int) -> str:
    thin = thinned(overlay.times_s.shape[1])
    t, measured, before, after = (
        np.asarray(a, dtype=float)[k, thin]
        for a in (overlay.times_s, overlay.measured, overlay.before, overlay.after)
    )
    seconds = f"{t[0]:.1f} to {t[-1]:.1f} s"
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(3.6, 2.5), layout="constrained")
        runs, errors = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
        _draw_runs(runs, t, measured, before, after, overlay.unit)
        _draw_errors(errors, t, before - measured, after - measured)
        runs.set_title(seconds)
        runs.set_ylabel(f"{overlay.channel} ({unit(overlay.unit)})")
        errors.set_ylabel("error")
        errors.set_xlabel("time (s)")
        figure.align_ylabels()
        label = f"{overlay.channel} from {seconds}: measured, before and after"
        return render_svg(figure, f"{overlay.channel}-{k}", label)


def _draw_runs(
    axes: Axes, t: Floats, measured: Floats, before: Floats, after: Floats, unit_name: str
) -> None:
    low, high = frame(measured, after)
    axes.plot(t, measured, **MEASURED)
    axes.plot(t, _near(before, low, high), **BEFORE)
    axes.plot(t, _near(after, low, high), **AFTER)
    axes.set_ylim(low, high)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.xaxis.set_major_locator(MaxNLocator(4))
    if np.any(_outside(before, low, high)):
        axes.set_title(
            f"before: up to {_worst(before - measured, unit_name)} off", loc="right", fontsize=7.5
        )


def _draw_errors(axes: Axes, t: Floats, before: Floats, after: Floats) -> None:
    largest = max(4 * _largest(after), 1e-9)
    limit = 1.1 * min(largest, max(_largest(before), _largest(after), 1e-9))
    axes.axhline(0, color=SOFT, linewidth=0.5)
    axes.plot(t, _near(before, -limit, limit), **BEFORE)
    axes.plot(t, _near(after, -limit, limit), **AFTER)
    axes.set_ylim(-limit, limit)
    axes.yaxis.set_major_locator(MaxNLocator(2, symmetric=True))


def _log_scale(axes: Axes) -> None:
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0), numticks=9))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.yaxis.set_minor_locator(NullLocator())


def _worst(errors: Floats, unit_name: str) -> str:
    finite = np.all(np.isfinite(errors))
    return quantity(_largest(errors), unit_name, 2) if finite else "infinitely far"


def _near(values: Floats, low: float, high: float) -> Floats:
    """Keep what lies far outside the frame from making huge numbers; a run that blew up ends at its edge."""
    room = 5 * (high - low)
    return np.clip(np.where(np.isfinite(values), values, np.nan), low - room, high + room)


def _outside(values: Floats, low: float, high: float) -> Mask:
    return ~((values >= low) & (values <= high))


def _largest(values: Floats) -> float:
    finite = np.abs(values[np.isfinite(values)])
    return float(finite.max()) if finite.size else 0.0


def _rms(run: Floats, measured: Floats) -> Floats:
    with np.errstate(over="ignore", invalid="ignore"):
        return np.sqrt(np.mean(np.square(np.asarray(run, dtype=float) - measured), axis=-1))


def _drawable(values: Floats) -> Floats:
    return np.where(np.isfinite(values) & (values > 0) & (values < 1e12), values, np.nan)


def render_svg(figure: Figure, key: str, label: str) -> str:
    """Return the figure as an `svg` element that scales with the page; ids begin with the key, unique on the page."""
    stream = io.StringIO()
    figure.savefig(stream, format="svg", metadata=NO_METADATA)
    text = stream.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<!--.*?-->|<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    text = re.sub(r' (?:width|height)="[\d.]+pt"', "", text, count=2)
    text = re.sub(r' d="[^"]*"', _shorter_path, text)
    text = re.sub(r"\n\s*", "\n", _own_ids(text, key))
    return text.replace("<svg", f'<svg role="img" aria-label="{escape(label)}"', 1)


def _shorter_path(path: re.Match[str]) -> str:
    return re.sub(r"(\.\d\d)\d+", r"\1", path[0])


def _own_ids(text: str, key: str) -> str:
    used = set(re.findall(r'(?:url\(|href=")#([^")]+)', text))
    prefix = re.sub(r"[^\w-]", "", key)
    text = re.sub(
        r' id="([^"]+)"', lambda m: f' id="{prefix}-{m[1]}"' if m[1] in used else "", text
    )
    return re.sub(r'(url\(|href=")#', rf"\1#{prefix}-", text)
