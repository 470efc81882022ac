"""The values that the given twin has, before and after the diagnosis, and those that changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.parameters import Free, convert_distance, list_rig_parameters
from pendulum_sysid.records import Estimate
from pendulum_sysid.telling.contradictions import compute_cart_mass, find_common_factor
from pendulum_sysid.telling.outcome import Findings
from pendulum_sysid.verdict.record import RigParameter
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import make_theta

FORCES = ("N", "kg")  # how the units of values begin that count by the moving mass


def compare_constants(findings: Findings) -> dict[str, RigParameter]:
    """Return the rig's constants, by name."""
    return {
        constant.name: _compare_constant(constant, findings)
        for constant in list_rig_parameters(findings.case.twin)
    }


def compare_effect_parameters(findings: Findings) -> dict[str, RigParameter]:
    """Return the parameters of the given twin's effects that were fitted, as effect.parameter."""
    given, base = findings.case.twin.effects, findings.base.estimates
    return {
        f"{name}.{p.name}": _compare(
            given[name][p.name], base.get(f"{name}.{p.name}"), after, p.unit
        )
        for name in given
        for p in BY_NAME[name].parameters
        if (after := findings.improved.estimates.get(f"{name}.{p.name}")) is not None
    }


def describe_changed(findings: Findings) -> str:
    """Return the values that the recording contradicts most, in brackets after a space.

    Without such a value the text is empty. A value is contradicted where its 95 % interval leaves
    the given value out and it changes by a twentieth or more. The order is that of the changes in
    units of their intervals. Where one mass of the cart explains the changes of all constants, it
    stands for them, and the forces of effects are those of a cart with this mass.
    """
    values = {**compare_constants(findings), **compare_effect_parameters(findings)}
    factor = find_common_factor(findings)
    words = []
    if factor is not None:
        mass, given = compute_cart_mass(findings, factor), findings.case.twin.rig.cart_mass_kg
        words = [f"cart_mass_kg {given:.3g} -> {mass:.3g} kg"]
        effects = compare_effect_parameters(findings)
        values = {name: _take_mass_out(value, factor) for name, value in effects.items()}
    strength = {name: _measure_change(value) for name, value in values.items()}
    names = sorted((name for name in values if strength[name] > 1.0), key=lambda n: -strength[n])
    words += [
        f"{name} {values[name].before:.3g} -> {values[name].after:.3g} {values[name].unit}"
        for name in names[: decisions.CHANGED_VALUES_LISTED]
    ]
    return f" ({', '.join(words)})" if words else ""


def _take_mass_out(value: RigParameter, factor: float) -> RigParameter:
    """Return a force or torque as it is with the cart's other mass; other values as they are.

    factor: by which all constants come out with the given mass.
    """
    if not value.unit.startswith(FORCES):
        return value
    after, low, high = value.after / factor, value.low / factor, value.high / factor
    return replace(value, after=after, low=low, high=high)


def _measure_change(value: RigParameter) -> float:
    """Return the change in half widths of its interval; 0 for a change that is not worth telling.

    A value that the recording does not fix, or that ends at its bound, tells nothing.
    """
    change, half = abs(value.after - value.before), 0.5 * (value.high - value.low)
    is_fixed = value.identifiable and not value.at_bound and np.isfinite(half)
    if not is_fixed or change < decisions.LEAST_MASKED_CHANGE * abs(value.after):
        return 0.0
    return change / half if half > 0.0 else np.inf


def _compare_constant(constant: Free, findings: Findings) -> RigParameter:
    twin = findings.case.twin
    base, after = (
        convert_distance(fit.estimates, twin, fit.twin)[constant.name]
        for fit in (findings.base, findings.improved)
    )
    return _compare(float(constant.get(make_theta(twin))), base, after, constant.unit)


def _compare(
    before: float,
    alone: Estimate | None,
    after: Estimate,
    unit: str,
) -> RigParameter:
    return RigParameter(
        before=before,
        parameters_alone=before if alone is None else float(alone.value),
        after=float(after.value),
        low=float(after.low),
        high=float(after.high),
        unit=unit,
        identifiable=bool(after.identifiable),
        at_bound=bool(after.at_bound),
    )
