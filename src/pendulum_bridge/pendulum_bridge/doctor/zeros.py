"""The checks of the zeros: hanging reads pi, the middle of the rail reads 0."""

from __future__ import annotations

import math

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.resting import AtRest
from pendulum_bridge.safety.reset import Rest

NEAR_RAD = Rest().pole_rad
LARGE_RAD = 0.2  # a larger offset is a mistake, not a carelessly set zero
NEAR_DEGREES = 10.0
MIDDLE_M = 0.05
HANGING_MISTAKEN_RAD = 0.3  # a field so near pi holds the pole's angle
FIELDS = ("pole angle", "pole rate", "cart position", "cart velocity")


def check_fields(rest_state: AtRest, rail_m: float | None) -> Finding:
    """Return whether the fields are in their order, as far as a hanging pole shows it.

    rail_m: half the rail's length; on a rail where the cart may stand at pi m no order shows.
    """
    expected = (
        f"{math.pi:.3f}, 0, the cart's position, 0 "
        "(pole angle, pole rate, cart position, cart velocity)"
    )
    values = (rest_state.pole_rad, rest_state.pole_rad_s, rest_state.cart_m, rest_state.cart_m_s)
    observed = ", ".join(f"{value:.3f}" for value in values)
    hanging = [abs(abs(value) - math.pi) < HANGING_MISTAKEN_RAD for value in values]
    if (rail_m or 0.0) < math.pi - HANGING_MISTAKEN_RAD and not hanging[0] and any(hanging[1:]):
        observed += f": the angle seems to stand in the place of the {FIELDS[hanging.index(True)]}"
        return Finding(Check.FIELDS, expected, observed, Fault.FIELDS_MIXED)
    return Finding(Check.FIELDS, expected, observed)


def check_pole_zero(rest_state: AtRest, offset_rad: float = 0.0) -> Finding:
    """Return whether a hanging pole reads pi.

    offset_rad: the offset that the twin file states.
    """
    hanging = math.pi + offset_rad
    expected = f"{hanging:.3f} rad while the pole hangs still"
    if rest_state.wrapped:
        return Finding(Check.POLE_ZERO, expected, "jumps of a whole turn", Fault.WRAPPED)
    return Finding(
        Check.POLE_ZERO,
        expected,
        f"{rest_state.pole_rad:.3f} rad",
        _find_pole_fault(rest_state.pole_rad, hanging),
    )


def check_cart_zero(rest_state: AtRest, rail_m: float | None) -> Finding:
    """Return whether the cart's zero can be in the middle of the rail.

    rail_m: half the rail's length; None when unknown.
    """
    expected = f"0 m with the cart in the middle (to {MIDDLE_M:g} m)"
    fault = Fault.OFF_MIDDLE if abs(rest_state.cart_m) > MIDDLE_M else None
    if rail_m is not None and abs(rest_state.cart_m) > rail_m:
        expected += f", the rail ending at {rail_m:g} m"
        fault = (
            Fault.MILLIMETRES
            if 5 * rail_m < abs(rest_state.cart_m) <= 1e3 * rail_m
            else Fault.BEYOND_RAIL
        )
    return Finding(Check.CART_ZERO, expected, f"{rest_state.cart_m:.3f} m", fault)


def check_rail(least_m: float, most_m: float, rail_m: float | None) -> Finding:
    """Return whether all positions of the cart were on the rail.

    least_m, most_m: its extreme positions.
    rail_m: half the rail's length; None when unknown.
    """
    observed = f"{least_m:.3f} to {most_m:.3f} m seen"
    if rail_m is None:
        return skip_check(Check.RAIL, "the twin file has no rail_half_length_m")
    fault = Fault.BEYOND_RAIL if max(abs(least_m), abs(most_m)) > rail_m else None
    return Finding(Check.RAIL, f"positions within {rail_m:g} m", observed, fault)


def _find_pole_fault(angle_rad: float, hanging_rad: float) -> Fault | None:
    off = angle_rad - hanging_rad
    within_turn = math.remainder(off, math.tau)
    if abs(off) <= NEAR_RAD:
        return None
    if abs(math.remainder(angle_rad, 360.0)) > 180.0 - NEAR_DEGREES:
        return Fault.DEGREES
    if abs(angle_rad) <= LARGE_RAD:
        return Fault.HANGS_AT_ZERO
    if abs(within_turn) <= NEAR_RAD:
        return Fault.TURNED
    return Fault.ZERO_OFF if abs(within_turn) <= LARGE_RAD else Fault.ZERO_WRONG
