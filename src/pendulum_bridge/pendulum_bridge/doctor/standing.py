"""The checks of a rig that stands: samples, rate, rest and zeros, from what was heard."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor import packets, resting, timing, zeros
from pendulum_bridge.doctor.faults import Fault, Verdict
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.listening import Listened, check_samples
from pendulum_bridge.doctor.resting import AtRest
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin

CHECKS = tuple(Check)[list(Check).index(Check.SAMPLES) : list(Check).index(Check.MOVES)]
FEWEST_SAMPLES = 3  # fewer samples show nothing


@dataclass(frozen=True)
class Standing:
    """Hold what a standing rig showed.

    findings: in the order of CHECKS.
    rest: what the rig reports at rest; None without samples.
    samples: (n, 4) in the protocol's order.
    """

    findings: tuple[Finding, ...]
    rest_state: AtRest | None
    samples: Floats


def check_standing(listened: Listened, twin: Twin, rate_hz: float) -> Standing:
    """Return all findings of a rig at rest; a check that cannot be made gives its reason."""
    findings = [check_samples(listened)]
    raw = [heard.packet for heard in listened.heard]
    unpacked = packets.unpack_samples(raw)
    good = [k for k, sample in enumerate(unpacked) if sample is not None]
    if raw:
        findings.append(packets.check_packets(raw))
    if len(good) < FEWEST_SAMPLES or findings[-1].verdict is Verdict.FAIL:
        why = (
            "no samples to look at"
            if len(good) < FEWEST_SAMPLES
            else "what was heard holds no samples or has ended"
        )
        return Standing(
            (*findings, *_skip_checks(CHECKS[len(findings) :], why)), None, np.empty((0, 4))
        )
    arrivals = np.array([listened.heard[k].at_s for k in good])
    samples = np.array(
        [(s.pole_rad, s.pole_rate, s.cart_m, s.cart_velocity) for s in unpacked if s is not None]
    )
    rest_state = resting.measure_rest(samples)
    fields = _check_fields(rest_state, twin)
    findings += [fields, *_check_timing(arrivals, rate_hz)]
    if fields.fault:
        findings += _skip_checks(CHECKS[len(findings) :], "the fields are not in their order")
    else:
        findings += _check_rest_and_zero(samples, rest_state, twin)
    return Standing(tuple(findings), rest_state, samples)


def _check_fields(rest_state: AtRest, twin: Twin) -> Finding:
    if not twin.rig.has_pole:
        return skip_check(Check.FIELDS, "the twin file has no pole")
    return zeros.check_fields(rest_state, twin.rig.rail_half_length_m)


def _check_timing(arrivals: Floats, rate_hz: float) -> list[Finding]:
    rate = timing.check_rate(arrivals, rate_hz)
    if len(arrivals) < timing.FEWEST_SAMPLES:
        return [rate, *_skip_checks((Check.JITTER, Check.LOSSES), "too few samples to tell")]
    period_s = timing.measure_period(arrivals, 1 / rate_hz)
    return [rate, timing.check_jitter(arrivals, period_s), timing.check_losses(arrivals, period_s)]


def _check_rest_and_zero(samples: Floats, rest_state: AtRest, twin: Twin) -> list[Finding]:
    offset_rad = twin.effects.get("angle_offset", {}).get("angle_rad", 0.0)
    pole = (
        zeros.check_pole_zero(rest_state, offset_rad)
        if twin.rig.has_pole
        else skip_check(Check.POLE_ZERO, "no pole in the twin file")
    )
    cart = zeros.check_cart_zero(rest_state, twin.rig.rail_half_length_m)
    samples = samples * _find_units(pole, cart)
    findings = [resting.check_rest(samples), resting.check_noise(samples)]
    if findings[0].fault is Fault.MOVING:
        why = "only a rig at rest shows it"
        return [
            *findings,
            *_skip_checks((Check.VELOCITIES, Check.POLE_ZERO, Check.CART_ZERO), why),
        ]
    return [*findings, resting.check_velocities(samples), pole, cart]


def _find_units(pole: Finding, cart: Finding) -> Floats:
    """Return the factors (4,) to SI units, so that a wrong unit is no noise or motion too."""
    pole_unit = math.radians(1) if pole.fault is Fault.DEGREES else 1.0
    cart_unit = 1e-3 if cart.fault is Fault.MILLIMETRES else 1.0
    return np.array([pole_unit, pole_unit, cart_unit, cart_unit])


def _skip_checks(checks: tuple[Check, ...], reason: str) -> list[Finding]:
    return [skip_check(check, reason) for check in checks]
