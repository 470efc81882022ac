"""Whether the encoders' readings can be true; when not, the cart's place is unknown and PWM is 0.

A jump that is back within a few samples is a spike: PWM is 0 meanwhile, and nothing else follows.
A jump that stays, and an encoder that is stuck, are latched until a person has looked at the rig
and clears the stop: the next readings are then believed.
"""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_bridge.safety.encoder_jump import Jumps, follow_positions
from pendulum_bridge.safety.encoder_reach import DRY_N, Reach, compute_reach
from pendulum_bridge.safety.encoder_stuck import (
    Holding,
    Still,
    compute_holding,
    find_stuck,
    follow_still,
)
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin.rig import Rig

GAP_S = 0.1  # longest time between samples after which the motion between them is known
SETTLED_S = 0.3  # after a spike or a gap, until reported velocities no longer show it


@dataclass(frozen=True)
class EncoderCheck:
    """Hold what is known of the rig.

    reach: how far positions can move between two samples.
    holding: what can hold the rig where it is.
    """

    reach: Reach
    holding: Holding


def make_encoder_check(
    rig: Rig, limit: float, period_s: float, dry_n: float = DRY_N
) -> EncoderCheck:
    """Return the check for a rig.

    limit: PWM fraction; the largest command.
    period_s: s, from sample to sample.
    dry_n: N; an upper bound of the cart's dry friction. With a lower bound a stuck encoder shows
        at smaller commands.

    Raises BadInputError for a rig without a cart.
    """
    return EncoderCheck(
        compute_reach(rig, limit, period_s, dry_n), compute_holding(rig, period_s, dry_n)
    )


@dataclass(frozen=True)
class Encoders:
    """Hold the state of the check between two samples.

    fault: why PWM has to be 0; a spike's fault ends by itself, others stay until `trust_again`.
    jumps: jumps of the positions.
    still: positions that do not change, see `encoder_stuck`; None while unsettled.
    unsettled_s: s; how long the check still says nothing about stuck encoders.
    """

    fault: Reason | None = None
    jumps: Jumps = Jumps()  # noqa: RUF009 (frozen)
    still: Still | None = None
    unsettled_s: float = 0.0

    @property
    def spikes(self) -> int:
        """The number of jumps since the start."""
        return self.jumps.spikes


def check_sample(
    encoders: Encoders, sample: RigState, applied: float, passed_s: float, check: EncoderCheck
) -> Encoders:
    """Return the state after a sample; PWM has to be 0 while the state has a fault.

    sample: finite.
    applied: PWM fraction that was sent since the last sample.
    passed_s: s, since the last sample; best from sampling times, as `arrival_clock` estimates
        them.
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
    """Return the state after a person has cleared the stop: readings are believed again."""
    return Encoders(jumps=Jumps(encoders.spikes))
