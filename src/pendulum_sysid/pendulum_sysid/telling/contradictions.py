"""Say which constants of the twin, as given, the recording contradicts."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.parameters import Free, list_rig_parameters
from pendulum_sysid.telling.outcome import Findings


def describe_contradictions(findings: Findings) -> tuple[str, ...]:
    """Return a sentence for every constant that the recording contradicts.

    A constant that is given with a spread is contradicted by a value that lies far outside.
    Without spreads, motion fixes only ratios to the moving mass: where both constants of the pole
    come out larger or smaller by one factor, the moving mass is wrong, and not the pole.
    """
    constants = list_rig_parameters(findings.case.twin)
    sentences = [_describe_far(c, findings) for c in constants if np.isfinite(c.spread)]
    sentences.append(_describe_moving_mass(findings))
    return tuple(sentence for sentence in sentences if sentence)


def _describe_far(constant: Free, findings: Findings) -> str:
    after = findings.best.estimates[constant.name]
    half = max(after.high - after.value, after.value - after.low) / decisions.INTERVAL_DEVIATIONS
    distance = abs(after.value - constant.believed) / float(np.hypot(half, constant.spread))
    if not after.identifiable or distance < decisions.CONTRADICTED_DEVIATIONS:
        return ""
    return (
        f"{constant.name}: {constant.believed:.3g} with a spread of {constant.spread:.2g} "
        f"{constant.unit} was given, and the recording shows {after.value:.3g} "
        f"[{after.low:.3g}, {after.high:.3g}]: measure it again."
    )


def _describe_moving_mass(findings: Findings) -> str:
    """Return the sentence about a wrong moving mass; empty where the pole's constants hold."""
    rig, estimates = findings.case.twin.rig, findings.best.estimates
    if not (rig.has_cart and rig.has_pole) or findings.case.twin.spreads:
        return ""
    given = {"com_distance_m": rig.com_distance_m, "pole_inertia_kg_m2": rig.pole_inertia_kg_m2}
    ratios = [estimates[name].value / (value or 1.0) for name, value in given.items()]
    if min(ratios) <= 0.0 or not all(estimates[name].identifiable for name in given):
        return ""
    common = float(np.sqrt(ratios[0] * ratios[1]))
    alike = max(ratios) / min(ratios) < decisions.ALIKE_RATIO
    if not alike or max(common, 1.0 / common) < decisions.MOVING_MASS_RATIO:
        return ""
    mass = rig.total_mass_kg / common - (rig.pole_mass_kg or 0.0)
    if mass <= 0.0:
        return ""
    more = "a motor's rotor or a belt moves with it?" if common < 1.0 else "is it lighter?"
    return (
        f"com_distance_m and pole_inertia_kg_m2 both come out {common:.3g} times as large as "
        "given. Motion fixes only ratios to the moving mass, so that the same motion is that "
        f"of the pole as given on a cart of {mass:.3g} kg instead of {rig.cart_mass_kg:.3g} kg: "
        f"{more} Correct cart_mass_kg, or give it with its spread."
    )
