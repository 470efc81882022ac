"""Jumps of a position: spikes, which are back within a few samples, and jumps that stay."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pendulum_bridge.safety.encoder_reach import (
    Anchor,
    Reach,
    age_anchor,
    compute_share_of_reach,
    is_nearer,
    make_anchor,
    move_anchor,
)
from pendulum_bridge.safety.rig_state import RigState

SPIKE_S, SPIKE_SAMPLES = 0.05, 3  # a spike lasts no longer than both
# good samples in a row after which a jump counts against the next sample, not against these
TRUSTED_SAMPLES = 5
UNEVEN_SHARE = 0.5  # deviation of a step, as a share of a period, that makes steps uneven
UNEVEN_S = 0.3  # how long steps then count as uneven
# periods by which more time may have passed than is known: usually, and while steps are uneven
SLACK_PERIODS, UNEVEN_SLACK_PERIODS = 1.0, 3.0


@dataclass(frozen=True)
class Jumps:
    """Hold the state of the jump detector.

    spikes: jumps since the start.
    anchor: the last good sample.
    elsewhere: where the positions have jumped to; None while they have not.
    away: samples since the jump.
    away_s: s, since the first of these samples.
    uneven_s: s; how long steps still count as uneven.
    """

    spikes: int = 0
    anchor: Anchor | None = None
    elsewhere: Anchor | None = None
    away: int = 0
    away_s: float = 0.0
    uneven_s: float = 0.0

    @property
    def stays(self) -> bool:
        """Whether the positions are away for longer than a spike."""
        return self.away > SPIKE_SAMPLES and self.away_s > SPIKE_S


def follow_positions(jumps: Jumps, sample: RigState, passed_s: float, reach: Reach) -> Jumps:
    """Return the state after a sample; the sample is good when `away` is 0 then.

    passed_s: s, since the last sample.
    """
    if jumps.anchor is None:
        return replace(jumps, anchor=make_anchor(sample, None, reach))
    even = abs(passed_s - reach.period_s) <= UNEVEN_SHARE * reach.period_s
    uneven_s = max(jumps.uneven_s - passed_s, 0.0) if even else UNEVEN_S
    slack_s = reach.period_s * (UNEVEN_SLACK_PERIODS if uneven_s else SLACK_PERIODS)
    anchor = age_anchor(jumps.anchor, passed_s)
    elsewhere = None if jumps.elsewhere is None else age_anchor(jumps.elsewhere, passed_s)
    jumped = compute_share_of_reach(sample, anchor, slack_s, reach) > 1
    if not (jumped or (elsewhere is not None and is_nearer(sample, elsewhere, anchor, reach))):
        return Jumps(jumps.spikes, make_anchor(sample, anchor, reach), uneven_s=uneven_s)
    new = jumps.away == 0
    if new and anchor.good < TRUSTED_SAMPLES:  # the first samples rather were the spike
        return Jumps(jumps.spikes + 1, make_anchor(sample, None, reach), uneven_s=uneven_s)
    away_s = 0.0 if new else jumps.away_s + passed_s
    return Jumps(
        jumps.spikes + new, anchor, move_anchor(sample, anchor), jumps.away + 1, away_s, uneven_s
    )
