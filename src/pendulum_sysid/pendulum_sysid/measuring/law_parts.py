"""Give effects the parts of a measured law that they are by definition."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid.finding.naming import is_left_parts
from pendulum_sysid.measuring.curve import PARTS, Curve
from pendulum_sysid.measuring.measure import Measured, drop_needless
from pendulum_sysid.measuring.penalised_fit import fit_laws
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS


def give_parts_back(measured: Measured, names: Sequence[str]) -> Measured:
    """Return the fit with the effects among names that its laws hold as parts; the laws lose them.

    A law that is measured in a fit without names holds the parts that names are by definition: an
    error of the angle over the turn holds the offset of the angle as its mean. The effects have no
    prior, and are asked as every name is. A law that lost parts goes if the fit does as well
    without the rest of the law.

    names: of effects of a fit without laws.
    """
    law_fit = measured.law_fit
    effects = law_fit.fit.effects
    theta, curves, back = law_fit.fit.theta.copy(), list(law_fit.curves), list[str]()
    changed = list[str]()
    for k, curve in enumerate(curves):
        own = [n for n in names if n not in effects and is_left_parts(n, [curve.kind.name])]
        if not own:
            continue
        parts = tuple(part for name in own for part in BY_NAME[name].law_parts)
        sizes, values = _part_values(curve, parts, curve.get_values(theta))
        for name in own:
            count = len(BY_NAME[name].law_parts)
            theta[SLOTS[name]], sizes = sizes[:count], sizes[count:]
        curves[k] = replace(curve, parts=(*curve.parts, *parts))
        curves[k].put(theta, values)
        back += own
        changed.append(curve.kind.name)
    if not back:
        return measured
    start = replace(law_fit.fit, theta=theta, effects=(*effects, *back))
    fit = fit_laws(
        measured.case, measured.split, start, tuple(curves), law_fit.priors, law_fit.inflation
    )
    parted = replace(measured, law_fit=replace(fit, lead=law_fit.lead))
    return drop_needless(parted, changed)


def _part_values(curve: Curve, parts: Sequence[str], values: Floats) -> tuple[Floats, Floats]:
    """Return the sizes of the parts in values (knots,), and the values without the parts."""
    shapes = np.array([PARTS[part](curve.knots) for part in parts]).T
    sizes = np.linalg.lstsq(shapes, values)[0]
    return sizes, values - shapes @ sizes
