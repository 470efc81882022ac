"""The pictures that a report's script draws anew, as numbers: one dictionary each."""

from __future__ import annotations

from typing import Any

import numpy as np

from pendulum_sysid.records import Evidence
from pendulum_sysid.telling.display import format_unit
from pendulum_sysid.telling.report_data import shorten
from pendulum_sysid.telling.svg import thin_out
from pendulum_sysid.verdict.drawn import ResidualTest
from pendulum_twin.arrays import Floats

Json = dict[str, Any]


def specify_shape(evidence: Evidence, key: str, x_label: str, y_label: str) -> Json | None:
    """Return the plot of a measured curve with its band; None for a single number."""
    if len(evidence.shape_x) < 2:
        return None
    order = np.argsort(evidence.shape_x, kind="stable")
    order = order[thin_out(len(order))]
    x, y = evidence.shape_x[order], evidence.shape_y[order]
    lines = [_make_line("measured shape", "after", y)]
    if evidence.shape_band.shape == evidence.shape_y.shape:
        span = max(float(np.ptp([0.0, *y])), 1e-12)
        band = np.minimum(evidence.shape_band[order], 2.0 * span)  # wide where little is measured
        lines += [_make_line("low", "band", y - band), _make_line("high", "band", y + band)]
    return _make_plot(key, x, x_label, y_label, lines)


def specify_residuals(test: ResidualTest) -> list[Json]:
    """Return the plots of a channel's tests: whiteness, command, spectrum."""
    name, unit = test.channel, format_unit(test.unit)
    white = [
        _make_line("error after", "after", test.whiteness),
        *_make_limits(test.lags_s, test.white_limit),
    ]
    plots = [_make_plot(f"white-{name}", test.lags_s, "lag (s)", "autocorrelation", white)]
    if len(test.command):
        plots.append(
            _make_plot(
                f"driven-{name}", test.command_lags_s, "lag (s)", "correlation with the command",
                [
                    _make_line("error after", "after", test.command),
                    *_make_limits(test.command_lags_s, test.command_limit),
                ],
            )
        )  # fmt: skip
    lines = [
        _make_line("before", "before", np.where(test.before > 0, test.before, np.nan)),
        _make_line("after", "after", np.where(test.after > 0, test.after, np.nan)),
        _make_line("sensor noise", "noise", np.full(len(test.after), test.noise)),
    ]
    label = f"error ({unit}/√Hz)"
    spectrum = _make_plot(
        f"spectrum-{name}", test.frequencies_hz, "frequency (Hz)", label, lines, log=True
    )
    return [*plots, spectrum]


def _make_limits(x: Floats, limit: float) -> list[Json]:
    return [
        _make_line("95 % low", "band", np.full(len(x), -limit)),
        _make_line("95 % high", "band", np.full(len(x), limit)),
    ]


def _make_line(label: str, role: str, values: Floats) -> Json:
    """Return a line; role: before, after, band (two lines) or noise, which fixes its look."""
    return {"label": label, "role": role, "values": shorten(values)}


def _make_plot(
    key: str, x: Floats, x_label: str, y_label: str, lines: list[Json], log: bool = False
) -> Json:
    """Return a plot. log: both axes are logarithmic."""
    return {
        "key": key, "x": shorten(x), "xLabel": x_label, "yLabel": y_label, "lines": lines,
        "log": log,
    }  # fmt: skip
