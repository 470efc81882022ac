"""The rows of a report about its errors and estimates: residual tests and correlations."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from markupsafe import Markup

from pendulum_sysid.telling import display
from pendulum_sysid.telling.report_data import shorten
from pendulum_sysid.telling.residual_figures import draw_residuals
from pendulum_sysid.verdict.drawn import ResidualTest
from pendulum_sysid.verdict.record import Verdict


@dataclass(frozen=True)
class ResidualRow:
    """Hold the tests of a channel's errors: a picture, and plots (key, title) of the script."""

    name: str
    words: str
    picture: Markup
    plots: tuple[tuple[str, str], ...]


def describe_residuals(test: ResidualTest) -> ResidualRow:
    """Return the tests of a channel in words and pictures."""
    outside = [
        float(np.mean(np.abs(values) > limit)) if len(values) else None
        for values, limit in (
            (test.whiteness[1:], test.white_limit),
            (test.command, test.command_limit),
        )
    ]
    white, command = (display.format_percent(share) for share in outside)
    words = f"{white} of the lags lie outside the band"
    if outside[1] is not None:
        words += f"; {command} of those with the command (5\u00a0% would by chance)"
    titles = (("white", "Whiteness"), ("driven", "Correlation with the command"))
    plots = [(f"{key}-{test.channel}", title) for key, title in titles]
    plots = plots[: 2 if len(test.command) else 1]
    spectrum = (f"spectrum-{test.channel}", "Spectrum of the error")
    picture = Markup(draw_residuals(test))
    return ResidualRow(test.channel, words, picture, (*plots, spectrum))


def round_correlations(verdict: Verdict) -> dict[str, Any]:
    """Return names and values of the correlations; None for what is not fixed."""
    fitted = verdict.correlations
    return {"names": fitted.names, "values": [shorten(row) for row in fitted.values]}
