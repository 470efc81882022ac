"""Whether the encoders' readings can be true. With one that cannot, nobody knows where the cart is: PWM 0.

A jump that is back within a few samples is a spike: PWM is 0 meanwhile, and that is all. One that
stays, and an encoder that
is stuck, are latched until somebody has looked at the rig and clears the stop: what is read next
is then believed.
"""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_bridge.safety.encoder_jump import Jumps, follow_positions
from pendulum_bridge.safety.encoder_reach import DRY_N, Reach, compute_reach
from pendulum_bridge.safety.encoder_stuck import (
    Holding,
    Still,
    compute_holding,
    follow_still,
    find_stuck,
)
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.rig import Rig

GAP_S = 0.1  # between samples: after it nobody knows what moved meanwhile
SETTLED_S = 0.3  # after a spike or a gap, until reported velocities are as if there had been none


@dataclass(frozen=True)
class EncoderCheck:
    """Hold what is known of the rig."""

    reach: Reach
    holding: Holding


def make_encoder_check(
    rig: Rig, limit: float, period_s: float, dry_n: float = DRY_N
) -> EncoderCheck:
    """Return the check for a rig driven with at most limit (PWM fraction); raise BadInputError without a cart.

    period_s: from sample to sample. dry_n: the cart's dry friction, at most: where less is sure, a
    stuck encoder shows at smaller commands.
    """
    return EncoderCheck(compute_reach(rig, limit, period_s, dry_n), compute_holding(rig, dry_n))


@dataclass(frozen=True)
class Encoders:
    """Hold what is remembered from one sample to the next.

    fault: why PWM has to be 0; a spike's goes by itself, others stay until `trust_again`. still:
    see `encoder_stuck`; None for unsettled_s, in which nothing is said about stuck encoders.
    """

    fault: Reason | None = None
    jumps: Jumps = Jumps()  # noqa: RUF009 (frozen)
    still: Still | None = None
    unsettled_s: float = 0.0

    @property
    def spikes(self) -> int:
        """Return how often a position has jumped since the start."""
        return self.jumps.spikes


def check_sample(
    encoders: Encoders, sample: RigState, applied: float, passed_s: float, check: EncoderCheck
) -> Encoders:
    """Return the state after a sample (finite), passed_s after the last, through which `applied` (PWM fraction) was sent.

    With a fault in the result, PWM has to be 0. passed_s: best from the samples' own times, as
    `arrival_clock` gives them.
    """
    jumps = follow_positions(encoders.jumps, sample, passed_s, check.reach)
    fault: Reason | None = None if encoders.fault is Reason.ENCODER_SPIKE else encoders.fault
    if jumps.spikes > encoders.spikes or jumps.away:
        fault = fault or (Reason.ENCODER_JUMPED if jumps.stays else Reason.ENCODER_SPIKE)
        return Encoders(fault, jumps, unsettled_s=SETTLED_S)
    unsettled_s = max(encoders.unsettled_s - passed_s, SETTLED_S if passed_s > GAP_S else 0.0)
    still = (
        None
        if unsettled_s > 0
        else follow_still(encoders.still, sample, applied, passed_s, check.holding)
    )
    if still is not None:
        fault = fault or find_stuck(still, check.holding)
    return Encoders(fault, jumps, still, unsettled_s)


def trust_again(encoders: Encoders) -> Encoders:
    """Return the state after somebody has cleared the stop: what is read next is believed, until it cannot be true."""
    return Encoders(jumps=Jumps(encoders.spikes))
