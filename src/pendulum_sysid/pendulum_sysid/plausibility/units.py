"""Compare what was measured with the twin, and name the option that mends another unit."""

from __future__ import annotations

import math
from collections.abc import Mapping

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.plausibility.balances import PoleBalance
from pendulum_twin.parameter_vector import (
    COUPLING,
    FORCE_PER_PWM,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    make_theta,
)

# options of `sysid import`: how many of the unit make one of the twin's
LENGTH_UNITS = {"--length-unit cm": 1e2, "--length-unit mm": 1e3}
TIME_UNITS = {"--time-unit ms": 1e3, "--time-unit us": 1e6, "--time-unit ns": 1e9}
COMMAND_UNITS = {"--command-unit percent": 1e2, "--command-unit per_mille": 1e3}


def advise_option(option: str, more: str = "") -> str:
    """Return the advice to import a file with an option; `more` follows the option."""
    return f"import the file with {option} {more}".rstrip()


def pick_unit(ratio: float, units: Mapping[str, float]) -> str | None:
    """Return the unit that a measured ratio to the twin's speaks for, if any."""
    for name, count in units.items():
        if abs(math.log(ratio / count)) <= math.log(decisions.UNIT_FACTOR):
            return name
    return None


def measure_length_unit(case: Case, balance: PoleBalance, gain: float) -> float | None:
    """Return how many of the position's unit make a metre, by pole or drive; None if unknown."""
    theta = make_theta(case.twin)
    if balance.explained >= decisions.BALANCE_SURE and balance.coupling > 0.0:
        return float(theta[COUPLING] / theta[INERTIA]) / balance.coupling
    own = float(theta[FORCE_PER_PWM] / theta[MASS])
    return gain / own if gain > 0.0 and own > 0.0 else None


def compute_own_gravity(case: Case) -> float:
    """Return the squared frequency of the hanging pole by the twin file, 1/s^2."""
    theta = make_theta(case.twin)
    return float(theta[MOMENT] * theta[GRAVITY] / theta[INERTIA])


def is_near(balance: PoleBalance, case: Case, factor: float) -> bool:
    """Tell whether the frequency is known, and the twin's up to a factor."""
    own = compute_own_gravity(case)
    if not (balance.gravity > 0.0 and own > 0.0):
        return False
    return abs(math.log(balance.gravity / own)) <= 2.0 * math.log(factor)
