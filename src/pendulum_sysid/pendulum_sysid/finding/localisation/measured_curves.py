"""Measure the shape of what is missing: curves with bands, fitted with the twin's constants."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.questions import Question
from pendulum_sysid.finding.localisation.table import Table
from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class MeasuredCurve:
    """Hold a measured curve.

    question: that it answers.
    x: (points,) where on its axis.
    y: (points,) how much.
    band: (points,) half widths of 95 % intervals, clustered by block.
    """

    question: Question
    x: Floats
    y: Floats
    band: Floats


def measure_curves(
    table: Table, keys: tuple[str, ...], theta: dict[str, float]
) -> list[MeasuredCurve]:
    """Return the curve of every question.

    theta: the twin's own constants, by the names of the balance's columns.
    """
    at = table.list_columns(keys)
    block = np.ix_(at, at)
    inverse = np.linalg.pinv(
        table.normal.sum(axis=0)[block] + table.count * table.penalty[block], hermitian=True
    )
    weights = inverse @ table.gradient.sum(axis=0)[at]
    residual = table.balance.lacking - table.columns[:, at] @ weights
    scores = np.zeros((int(table.balance.block.max()) + 1, len(at)))
    np.add.at(scores, table.balance.block, table.columns[:, at] * residual[:, None])
    spread = inverse @ (scores.T @ scores) @ inverse
    scale = table.scale[at]
    place = {int(column): k for k, column in enumerate(at)}
    return [
        _measure_curve(table, key, weights / scale, spread / np.outer(scale, scale), place, theta)
        for key in keys
    ]


def _measure_curve(
    table: Table,
    key: str,
    weights: Floats,
    spread: Floats,
    place: dict[int, int],
    theta: dict[str, float],
) -> MeasuredCurve:
    """Return a question's curve, with the share of the twin's own constant in it."""
    question = table.questions[key]
    used = table.used[key]
    own = [place[column] for column in range(table.at[key].start, table.at[key].stop)]
    x = question.x if question.drawn is not None else question.x[used]
    onto = np.zeros((len(x), len(weights)))
    onto[:, own] = np.eye(len(own)) if question.drawn is None else question.drawn[:, used]
    what, own_part = question.measured, 0.0
    if what.turned is not None:
        sign = 1.0 if what.turned == "drive" else -1.0
        onto[:, table.balance.names.index(what.turned)] += sign * (
            x if what.straight else np.ones_like(x)
        )
        own_part = 0.0 if what.straight else sign * theta[what.turned]
    y = onto @ weights + own_part
    if what.straight:
        y = y - compute_typical_slope(x, y) * x
        onto = onto - np.outer(x, x @ onto) / max(float(x @ x), 1e-300)
    band = decisions.INTERVAL_DEVIATIONS * np.sqrt(
        np.maximum(np.einsum("ij,jk,ik->i", onto, spread, onto), 0.0)
    )
    return MeasuredCurve(question, x, what.sign * y, band)


def compute_typical_slope(x: Floats, y: Floats) -> float:
    """Return the slope that half of a curve's length lies above, as of a viscous law or a gain.

    A curve against the speed says what it is beside the viscous friction only up to a straight
    part; this choice leaves dry friction flat on either side of its jump, and a dead zone or a
    saturation straight where they do not act.
    """
    step = np.diff(x)
    inside = step > 1e-9 * max(float(np.ptp(x)), 1e-300)
    if not inside.any():
        return 0.0
    slope, step = (np.diff(y)[inside] / step[inside]), step[inside]
    order = np.argsort(slope)
    return float(slope[order][np.searchsorted(np.cumsum(step[order]), 0.5 * step.sum())])
