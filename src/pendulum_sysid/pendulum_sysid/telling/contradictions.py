"""Say which constants of the twin, as given, the recording contradicts."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.parameters import Free, list_rig_parameters
from pendulum_sysid.records import Estimate
from pendulum_sysid.telling.outcome import Findings

POLE_CONSTANTS = ("com_distance_m", "pole_inertia_kg_m2")
CONSTANTS = ("force_per_pwm_n", "cart_viscous_n_s_m", *POLE_CONSTANTS, "pole_viscous_n_m_s")


def describe_contradictions(findings: Findings) -> tuple[str, ...]:
    """Return a sentence for every constant that the recording contradicts.

    A constant that is given with a spread is contradicted by a value that lies far outside.
    Without spreads see `find_cart_mass`.
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


def find_cart_mass(findings: Findings) -> float | None:
    """Return the cart's mass, kg, that explains why the constants come out by one factor.

    Motion fixes only ratios to the moving mass. Where all constants come out larger or smaller by
    one factor, within their intervals, that mass has changed and nothing else; where both
    constants of the pole do by much, the mass was given wrong. None otherwise, and where spreads
    say what is believed.
    """
    rig, estimates = findings.case.twin.rig, findings.final.estimates
    if not (rig.has_cart and rig.has_pole) or findings.case.twin.spreads:
        return None
    factors = {name: _measure_factor(getattr(rig, name), estimates[name]) for name in CONSTANTS}
    common = _find_common_factor([f for f in factors.values() if f is not None])
    if common is None:
        common = _find_factor_of_pole([factors[name] for name in POLE_CONSTANTS])
    if common is None:
        return None
    mass = rig.total_mass_kg / common - (rig.pole_mass_kg or 0.0)
    return mass if mass > 0.0 else None


def _measure_factor(given: float | None, after: Estimate) -> tuple[float, float] | None:
    """Return the logarithm of a constant's change and its deviation; None without an estimate."""
    if not given or not after.identifiable or not 0.0 < after.low < after.high:
        return None
    half = 0.5 * float(np.log(after.high / after.low)) / decisions.INTERVAL_DEVIATIONS
    return float(np.log(after.value / given)), float(np.hypot(half, decisions.GIVEN_DEVIATION))


def _find_common_factor(factors: list[tuple[float, float]]) -> float | None:
    """Return the factor that all constants have in common; None where they have none, or 1."""
    if len(factors) < len(CONSTANTS):
        return None
    logs, deviations = np.array(factors).T
    common = float(np.average(logs, weights=deviations**-2))
    apart = np.max(np.abs(logs - common) / deviations)
    is_changed = abs(common) > decisions.LEAST_MASKED_CHANGE
    return (
        float(np.exp(common)) if is_changed and apart < decisions.CONTRADICTED_DEVIATIONS else None
    )


def _find_factor_of_pole(factors: list[tuple[float, float] | None]) -> float | None:
    """Return the factor of both constants of the pole; None where they have none that is large."""
    logs = np.array([factor[0] for factor in factors if factor is not None])
    if len(logs) < len(POLE_CONSTANTS) or np.ptp(logs) >= np.log(decisions.ALIKE_RATIO):
        return None
    common = float(np.mean(logs))
    return float(np.exp(common)) if abs(common) >= np.log(decisions.MOVING_MASS_RATIO) else None


def _describe_moving_mass(findings: Findings) -> str:
    """Return the sentence about a wrong moving mass; empty where the constants hold."""
    mass, given = find_cart_mass(findings), findings.case.twin.rig.cart_mass_kg or 0.0
    if mass is None:
        return ""
    more = "a load on it, a motor's rotor or a belt?" if mass > given else "is it lighter?"
    return (
        "Constants of the rig come out by one common factor. Motion fixes only ratios to the "
        f"moving mass, so that the same motion is that of the rig as given with a cart of "
        f"{mass:.3g} kg instead of {given:.3g} kg: {more} Correct cart_mass_kg, or give it with "
        "its spread."
    )
