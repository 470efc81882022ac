"""Ask names again beside measured laws: which the twin needs, and which are parts of a law."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid.finding.judge import compute_lead
from pendulum_sysid.measuring.curve import LEVELS, PARTS
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.penalised_fit import fit_laws
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


def list_sized(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names that the fit holds with a size, and so could do without."""
    effects = measured.law_fit.fit.effects
    return [name for name in names if name in effects and not BY_NAME[name].is_switch]


def list_needed(measured: Measured, sized: Sequence[str]) -> tuple[str, ...]:
    """Return the effects without which a fit with the same laws is worse on windows left out.

    sized: see `list_sized`.

    Laws take what had no name. An effect that they can stand for may have stood for that; an
    effect that they cannot stand for is there by itself.
    """
    law_fit, needed = measured.law_fit, []
    for name in sized:
        start = law_fit.fit
        theta = start.theta.copy()
        theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
        effects = tuple(effect for effect in start.effects if effect != name)
        less = fit_laws(
            measured.case,
            measured.split,
            replace(start, theta=theta, effects=effects),
            law_fit.curves,
            law_fit.priors,
            law_fit.inflation,
        )
        if compute_lead(start, less.fit).is_real:
            needed.append(name)
    return tuple(needed)


def list_lesser_parts(measured: Measured, names: Sequence[str]) -> list[str]:
    """Return the effects among names that are a part of a law and smaller than the rest of it.

    The error of a disc may have any shape. The first wave of that error (`Effect.law_parts`) is a
    name only where the wave is larger than the rest of the error.
    """
    law_fit, lesser = measured.law_fit, []
    for curve, values in zip(law_fit.curves, law_fit.values, strict=True):
        for effect in (BY_NAME[name] for name in names):
            if effect.law_parts and effect.law_kind == curve.kind.name:
                sizes = law_fit.fit.theta[SLOTS[effect.name]]
                parts = [PARTS[part](curve.knots) for part in effect.law_parts]
                own = np.average((sizes @ np.array(parts)) ** 2, weights=curve.visits)
                if own < np.average(values**2, weights=curve.visits):
                    lesser.append(effect.name)
    return lesser


def is_part_of_law(measured: Measured, name: str) -> bool:
    """Return whether a measured law contains an effect, or leaves it a level of friction."""
    effect = BY_NAME[name]
    return any(
        curve.kind.name == effect.law_kind
        or (
            effect.form is Form.DRY
            and curve.kind.place is effect.place
            and {(curve.kind.role, None), (curve.kind.role, curve.kind.variable)} & set(LEVELS)
        )
        for curve in measured.law_fit.curves
    )
