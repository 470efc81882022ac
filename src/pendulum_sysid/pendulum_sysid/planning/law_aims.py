"""The aims to narrow the bands of measured laws.

The values of a law move as its prior lets them: along the draws of the Gaussian process under
which the recording is likeliest (`measuring.smoothness`). The prior counts once, and the plan's
recording adds its information to that of the recordings at hand.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.linalg import block_diag

from pendulum_sysid.finding.separation import compute_columns, pose_on_deciding_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.measuring.curve import Curve, list_curves
from pendulum_sysid.measuring.penalised_fit import list_all_free, list_parts
from pendulum_sysid.measuring.smoothness import choose_smoothness, eliminate, make_covariance
from pendulum_sysid.planning.aims import Linearisation, Narrowing
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.laws.kind import Variable
from pendulum_twin.laws.law import evaluate_law, make_curve_matrix
from pendulum_twin.parameter_vector import get_laws

GAUGED = 1e-4  # of the largest variance, below which a direction of the prior is held at 0


def list_band_narrowings(
    case: Case, split: Split, best: Fit, bands: Mapping[str, Floats]
) -> list[Narrowing]:
    """Return an aim for each measured law of a fit, except laws over time.

    A law over time is known better from a longer recording, whatever is played.

    bands: law -> (knots,) half widths of its band now, at the knots of the twin's law, in the unit
        of its values; the other laws of the twin are as they are given.
    """
    theta = best.theta.copy()
    curves, halves = _lay_curves(case, best.effects, theta, bands)
    if not curves:
        return []
    free = list_all_free(case, best.effects, theta, curves)
    problem, power = pose_on_deciding_windows(case, split, best)
    normal = compute_columns(problem, theta, free, power).normal
    parts = list_parts(len(free), curves)
    own = parts[0].start
    draws = [
        _draw_prior(curve, normal, part, curve.get_values(theta) / curve.size)
        for curve, part in zip(curves, parts, strict=True)
    ]
    directions = block_diag(np.eye(own), *draws)
    drawn = np.arange(directions.shape[1]) >= own
    about = Linearisation(theta, free)
    seen = directions.T @ normal @ directions + np.diag(drawn.astype(float))
    return [
        Narrowing(
            subject=curve.kind.name,
            linearisation=about,
            halves=band,
            scale=float(np.sqrt(np.mean(curve.get_values(theta) ** 2))),
            unit=curve.kind.quantity.unit,
            directions=directions,
            sums=directions[part] * curve.size,
            normal=seen,
        )
        for curve, part, band in zip(curves, parts, halves, strict=True)
    ]


def _lay_curves(
    case: Case, effects: tuple[str, ...], theta: Floats, bands: Mapping[str, Floats]
) -> tuple[tuple[Curve, ...], list[Floats]]:
    """Return the curves of theta (SIZE,) that have bands, and the bands at the curves' knots.

    Theta gets the values at these knots, which show where runs depend on the curve: a formula is
    drawn over many more.
    """
    laws = get_laws(theta)
    curves, halves = list[Curve](), list[Floats]()
    for curve in list_curves(case, theta, effects):
        kind = curve.kind
        law, band = laws.get(kind.name), bands.get(kind.name, np.empty(0))
        if law is None or len(band) != len(law.knots) or kind.variable is Variable.TIME:
            continue
        knots = np.array(law.knots)
        if kind.remembers:  # its values are elements, and no curve
            curves.append(replace(curve, knots=knots))
            halves.append(band)
            continue
        curve.put(theta, np.maximum(evaluate_law(kind, law, curve.knots), curve.low))
        curves.append(curve)
        halves.append(abs(make_curve_matrix(kind, knots, curve.knots) @ band))
    return tuple(curves), halves


def _draw_prior(curve: Curve, normal: Floats, part: slice, values: Floats) -> Floats:
    """Return draws (knots, directions) of unit size of the values of a law, in typical sizes.

    normal: of all parameters, in their sizes.
    part: place of the values (knots,) among them.
    """
    count = len(values)
    order = np.concatenate([np.delete(np.arange(len(normal)), part), np.arange(len(normal))[part]])
    turned = normal[np.ix_(order, order)]
    matrix, gradient = eliminate(turned, turned[:, -count:] @ values, count)
    prior = choose_smoothness(curve, matrix, gradient, 1.0)
    variances, along = np.linalg.eigh(make_covariance(curve, prior.length))
    moves = variances > GAUGED * variances.max()
    return np.asarray(prior.size * along[:, moves] * np.sqrt(variances[moves]))
