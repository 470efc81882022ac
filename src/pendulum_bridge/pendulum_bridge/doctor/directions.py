"""The signs of command, cart and pole.

A positive command has to move the cart the positive way. And hanging (th = pi + ph, cos th = -1),
the second equation of motion (`pendulum_twin.equations`) reads Jp ph'' = -S (v' + g ph): a cart
that is accelerated the positive way turns the pole the negative way. Integrated once, ph' =
-(S/Jp) (v + g * integral of ph). A fit has a factor for each of the two terms: the first factor
has the sign in question; the second is negative whichever way the angle counts.

When command, cart or angle alone has the wrong sign, the other two show which. Two wrong signs
look like the third sign alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.resting import CART, POLE
from pendulum_bridge.doctor.track import Grid, compute_slopes
from pendulum_twin.arrays import Floats
from pendulum_twin.rig import Rig

HALF_BASE_SAMPLES = 2  # half the base of a difference
SIGN_STANDARD_DEVIATIONS = 4.0  # from 0, for a sign to be sure
STANDING_SHARE = 0.1  # of the expected motion; a pole that moves less has no working encoder
MIRRORED = {  # by (command to cart, cart to pole): whether each is as expected
    (True, True): None,
    (False, True): Fault.COMMAND_MIRRORED,
    (False, False): Fault.CART_MIRRORED,
    (True, False): Fault.ANGLE_MIRRORED,
}
WAY_NAMES = {1: "positive", -1: "negative"}


@dataclass(frozen=True)
class PoleAnswer:
    """Hold how the pole follows the cart.

    per_m: pole rate for a change of the cart's velocity, rad/m.
    deviation: standard deviation of per_m.
    stands: whether the pole does not follow at all.
    """

    per_m: float
    deviation: float
    stands: bool

    @property
    def way(self) -> int:
        """Return +1 when a positive push turns the pole negatively, -1 if not, 0 if unsure."""
        return (
            0
            if self.stands or abs(self.per_m) < SIGN_STANDARD_DEVIATIONS * self.deviation
            else int(-np.sign(self.per_m))
        )


def measure_pole_answer(grid: Grid, hanging_rad: float, lever_per_m: float) -> PoleAnswer:
    """Return how the pole answered the cart's motion.

    hanging_rad: angle that the rig reports while the pole hangs.
    lever_per_m: S/Jp of the twin file, for the motion that is expected.
    """
    from_hanging = grid.samples[:, POLE] - hanging_rad
    rate, speed = (
        compute_slopes(values, grid.period_s, HALF_BASE_SAMPLES)
        for values in (from_hanging, grid.samples[:, CART])
    )
    fallen = np.cumsum(from_hanging[HALF_BASE_SAMPLES:-HALF_BASE_SAMPLES]) * grid.period_s
    terms = np.stack([speed, fallen, np.ones_like(speed)], axis=1)
    factors, deviations = solve_least_squares(terms, rate)
    stands = float(np.ptp(rate)) < STANDING_SHARE * lever_per_m * float(np.ptp(speed))
    return PoleAnswer(float(factors[0]), float(deviations[0]), stands)


def check_directions(
    way: int, pole: PoleAnswer, expected_ways: tuple[int, int], has_pole: bool
) -> Finding:
    """Return whether command, cart and pole count as the twin file says.

    way: of the measured cart under a positive command, +1 or -1.
    pole: how the pole followed.
    expected_ways: ways of cart and pole by the twin file; see `signs.find_ways`.
    has_pole: whether the twin file has a pole.
    """
    expected = f"a positive command to move the cart the {WAY_NAMES[expected_ways[0]]} way"
    observed = f"it went the {WAY_NAMES[way]} way"
    if not has_pole:
        fault = None if way == expected_ways[0] else Fault.COMMAND_MIRRORED
        return Finding(Check.DIRECTIONS, expected, observed, fault)
    pole_turn = WAY_NAMES[-expected_ways[0] * expected_ways[1]]
    expected += f", and so to turn the hanging pole the {pole_turn} way"
    if pole.stands:
        return Finding(
            Check.DIRECTIONS,
            expected,
            f"{observed}, and the pole did not follow",
            Fault.POLE_STANDS,
        )
    if pole.way == 0:
        return skip_check(
            Check.DIRECTIONS,
            f"{observed}; which way the pole follows could not be told from so little motion",
        )
    observed += (
        f", the pole the {WAY_NAMES[-way * pole.way]} way ({abs(pole.per_m):.1f} rad/s for 1 m/s)"
    )
    return Finding(
        Check.DIRECTIONS,
        expected,
        observed,
        MIRRORED[way == expected_ways[0], pole.way == expected_ways[1]],
    )


def compute_lever_per_m(rig: Rig) -> float:
    """Return S/Jp (1/m): rad/s of the pole for 1 m/s of the cart; 0 without a pole."""
    return (
        rig.total_mass_kg * (rig.com_distance_m or 0.0) / rig.pole_inertia_kg_m2
        if rig.pole_inertia_kg_m2
        else 0.0
    )


def solve_least_squares(terms: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the factors of a linear fit and their standard deviations, (k,) each.

    terms: (n, k). values: (n,). Deviations are infinite when the terms are dependent or too few.
    """
    factors, _, rank, _ = np.linalg.lstsq(terms, values, rcond=None)
    if rank < terms.shape[1] or len(values) <= terms.shape[1]:
        return factors, np.full(terms.shape[1], np.inf)
    residuals = values - terms @ factors
    variance = float(residuals @ residuals) / (len(values) - terms.shape[1])
    return factors, np.sqrt(variance * np.diag(np.linalg.inv(terms.T @ terms)))
