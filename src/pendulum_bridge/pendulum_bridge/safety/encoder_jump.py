"""Jumps of a position: spikes, which are back within a few samples, and those that stay."""

from __future__ import annotations

from dataclasses import dataclass, replace

from pendulum_bridge.safety.encoder_reach import (
    Anchor,
    Reach,
    make_anchor,
    age_anchor,
    move_anchor,
    is_nearer,
    compute_share_of_reach,
)
from pendulum_bridge.safety.rig_state import RigState

SPIKE_S, SPIKE_SAMPLES = 0.05, 3  # a spike lasts no longer than both
TRUSTED_SAMPLES = (
    5  # good samples in a row before a jump counts against the next rather than against these
)
UNEVEN_SHARE, UNEVEN_S = (
    0.5,
    0.3,
)  # share of a period by which a step makes steps uneven, and for how long
SLACK_PERIODS, UNEVEN_SLACK_PERIODS = (
    1.0,
    3.0,
)  # periods more than are known that may have passed; the second while steps are uneven


@dataclass(frozen=True)
class Jumps:
    """Hold what is remembered of the positions.

    spikes: jumps since the start. anchor: the last good sample. elsewhere: where the positions
    have jumped to, for away samples, the first of them away_s ago; None while they have not.
    uneven_s: for how long steps count as uneven.
    """

    spikes: int = 0
    anchor: Anchor | None = None
    elsewhere: Anchor | None = None
    away: int = 0
    away_s: float = 0.0
    uneven_s: float = 0.0

    @property
    def stays(self) -> bool:
        """Tell whether the positions are away for longer than a spike."""
        return self.away > SPIKE_SAMPLES and self.away_s > SPIKE_S


def follow_positions(jumps: Jumps, sample: RigState, passed_s: float, reach: Reach) -> Jumps:
    """Return the state after a sample, passed_s after the last; the sample is good when nothing is away then."""
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
    if new and anchor.good < TRUSTED_SAMPLES:  # rather the first samples were the spike
        return Jumps(jumps.spikes + 1, make_anchor(sample, None, reach), uneven_s=uneven_s)
    away_s = 0.0 if new else jumps.away_s + passed_s
    return Jumps(
        jumps.spikes + new, anchor, move_anchor(sample, anchor), jumps.away + 1, away_s, uneven_s
    )
