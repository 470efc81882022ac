"""Say which constants of the twin, as given, the recording contradicts, and which times."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.late_command import LATE
from pendulum_sysid.fitting.parameters import Free, list_rig_parameters
from pendulum_sysid.records import Estimate
from pendulum_sysid.telling.outcome import Findings

POLE_CONSTANTS = ("com_distance_m", "pole_inertia_kg_m2")
LEAST_LOG = decisions.LEAST_MASKED_CHANGE  # of a factor that is worth a sentence
CONSTANTS = ("force_per_pwm_n", "cart_viscous_n_s_m", *POLE_CONSTANTS, "pole_viscous_n_m_s")


def describe_contradictions(findings: Findings) -> tuple[str, ...]:
    """Return a sentence for every constant that the recording contradicts, and on late commands.

    A constant that is given with a spread is contradicted by a value that lies far outside.
    Without spreads see `find_common_factor`.
    """
    constants = list_rig_parameters(findings.case.twin)
    sentences = [_describe_far(c, findings) for c in constants if np.isfinite(c.spread)]
    sentences.append(_describe_moving_mass(findings))
    late = [fault.note for fault in findings.case.recording.findings if fault.kind == LATE]
    sentences += [f"{note[:1].upper()}{note[1:]}." for note in late]
    return tuple(sentence for sentence in sentences if sentence)


def _describe_far(constant: Free, findings: Findings) -> str:
    after = findings.improved.estimates[constant.name]
    half = max(after.high - after.value, after.value - after.low) / decisions.INTERVAL_DEVIATIONS
    distance = abs(after.value - constant.believed) / float(np.hypot(half, constant.spread))
    if not after.identifiable or distance < decisions.CONTRADICTED_DEVIATIONS:
        return ""
    return (
        f"{constant.name}: {constant.believed:.3g} with a spread of {constant.spread:.2g} "
        f"{constant.unit} was given, and the recording shows {after.value:.3g} "
        f"[{after.low:.3g}, {after.high:.3g}]: measure it again."
    )


def find_common_factor(findings: Findings) -> float | None:
    """Return the factor by which all constants of the rig come out, within their intervals.

    Motion fixes only ratios to the moving mass: such a rig has another mass, and nothing else has
    changed. None where constants disagree, where the factor is near 1, and where spreads say what
    is believed.
    """
    factors = _measure_factors(findings)
    known = [factor for factor in factors.values() if factor is not None]
    if len(known) < len(CONSTANTS):
        return None
    logs, deviations = np.array(known).T
    common = float(np.average(logs, weights=deviations**-2))
    apart = float(np.max(np.abs(logs - common) / deviations))
    is_common = apart < decisions.CONTRADICTED_DEVIATIONS
    return float(np.exp(common)) if is_common and abs(common) > LEAST_LOG else None


def compute_cart_mass(findings: Findings, factor: float) -> float:
    """Return the cart's mass, kg, of a rig whose constants come out by a factor."""
    rig = findings.case.twin.rig
    return rig.total_mass_kg / factor - (rig.pole_mass_kg or 0.0)


def _measure_factors(findings: Findings) -> dict[str, tuple[float, float] | None]:
    """Return the logarithm of each constant's change with its deviation; empty without a pole."""
    rig, estimates = findings.case.twin.rig, findings.improved.estimates
    if not (rig.has_cart and rig.has_pole) or findings.case.twin.spreads:
        return {}
    return {name: _measure_factor(getattr(rig, name), estimates[name]) for name in CONSTANTS}


def _measure_factor(given: float | None, after: Estimate) -> tuple[float, float] | None:
    """Return the logarithm of a constant's change and its deviation; None without an estimate."""
    if not given or not after.identifiable or not 0.0 < after.low < after.high:
        return None
    half = 0.5 * float(np.log(after.high / after.low)) / decisions.INTERVAL_DEVIATIONS
    return float(np.log(after.value / given)), float(np.hypot(half, decisions.GIVEN_DEVIATION))


def _find_factor_of_pole(factors: list[tuple[float, float] | None]) -> float | None:
    """Return the factor of both constants of the pole; None where they have none that is large."""
    logs = np.array([factor[0] for factor in factors if factor is not None])
    if len(logs) < len(POLE_CONSTANTS) or np.ptp(logs) >= np.log(decisions.ALIKE_RATIO):
        return None
    common = float(np.mean(logs))
    return float(np.exp(common)) if abs(common) >= np.log(decisions.MOVING_MASS_RATIO) else None


def _describe_moving_mass(findings: Findings) -> str:
    """Return the sentence about a wrong moving mass; empty where the constants hold."""
    which, factor = "All constants of the rig", find_common_factor(findings)
    if factor is None:
        factors = _measure_factors(findings)
        which = " and ".join(POLE_CONSTANTS)
        factor = _find_factor_of_pole([factors.get(name) for name in POLE_CONSTANTS])
    mass = 0.0 if factor is None else compute_cart_mass(findings, factor)
    if factor is None or mass <= 0.0:
        return ""
    given = findings.case.twin.rig.cart_mass_kg or 0.0
    more = "a load on it, a motor's rotor or a belt?" if mass > given else "is it lighter?"
    return (
        f"{which} come out {factor:.3g} times as large as given. Motion fixes only ratios to the "
        f"moving mass, so that the same motion is that of the rig as given with a cart of "
        f"{mass:.3g} kg instead of {given:.3g} kg: {more} Correct cart_mass_kg, or give it with "
        "its spread."
    )
