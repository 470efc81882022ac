"""Pictures of what the errors of held-out runs still show: whiteness, command, spectrum."""

from __future__ import annotations

import matplotlib.style
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator

from pendulum_sysid.telling.display import format_unit
from pendulum_sysid.telling.svg import AFTER, BEFORE, STYLE, render_svg
from pendulum_sysid.verdict.drawn import ResidualTest
from pendulum_sysid.verdict.look import ACCENT, SOFT, keep_drawable_on_log_scale
from pendulum_twin.arrays import Floats

MARGINS = {"left": 0.07, "right": 0.99, "bottom": 0.22, "top": 0.88, "wspace": 0.26}


def draw_residuals(test: ResidualTest) -> str:
    """Return the three tests of a channel side by side, with their 95 % lines."""
    with matplotlib.style.context(["default", STYLE]):
        figure = Figure(figsize=(9.0, 2.2))
        own, command, spectrum = figure.subplots(1, 3)
        figure.subplots_adjust(**MARGINS)
        _draw_correlation(own, test.lags_s, test.whiteness, test.white_limit, "whiteness")
        _draw_correlation(
            command, test.command_lags_s, test.command, test.command_limit, "with the command"
        )
        _draw_spectrum(spectrum, test)
        label = f"{test.channel}: whiteness, correlation with the command, and spectrum"
        return render_svg(figure, f"residual-{test.channel}", label)


def _draw_correlation(
    axes: Axes, lags_s: Floats, values: Floats, limit: float, title: str
) -> None:
    axes.set_title(title)
    axes.set_xlabel("lag (s)")
    if not len(values):
        axes.text(0.5, 0.5, "no command", ha="center", transform=axes.transAxes, color=SOFT)
        return
    axes.axhspan(-limit, limit, facecolor=ACCENT, alpha=0.15, linewidth=0)
    axes.axhline(0, color=SOFT, linewidth=0.5)
    axes.plot(lags_s, values, **AFTER)
    axes.set_ylim(min(-0.3, float(values.min()) - 0.1), max(0.3, float(values.max()) + 0.1))


def _draw_spectrum(axes: Axes, test: ResidualTest) -> None:
    unit = format_unit(test.unit)
    axes.set_title(f"spectrum of the error ({unit}/√Hz)")
    axes.set_xlabel("frequency (Hz)")
    for values, look in ((test.before, BEFORE), (test.after, AFTER)):
        axes.plot(test.frequencies_hz, keep_drawable_on_log_scale(values), **look)
    axes.axhline(test.noise, color=SOFT, linewidth=0.7, linestyle=":")
    axes.set_xscale("log")
    axes.set_yscale("log")
    # plain numbers: powers of ten take long to typeset
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(numticks=6))
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_locator(NullLocator())
