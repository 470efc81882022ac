"""Several recordings of one rig as one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pendulum_sysid.command_doubt import join_doubts
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.records import CommandLatency, QualityFinding, Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.signals import Signals, join_signals

PERIODS_DIFFER = 1e-3  # of the period: the least difference that data_quality tells


def join_recordings(recordings: Sequence[Recording]) -> Recording:
    """Join recordings of one rig, each its own stretch; their times follow one another.

    Raises WrongUse when they do not fit together.
    """
    if len(recordings) == 1:
        return recordings[0]
    return Recording(
        " + ".join(recording.name for recording in recordings),
        " + ".join(recording.digest for recording in recordings),
        _join_signals(recordings),
        _join_findings(recordings),
        _join_rates(recordings),
        max(recording.timing_spread_s for recording in recordings),
        _pick_latency(recordings),
        join_doubts([each.doubt for each in recordings], [len(r.signals) for r in recordings]),
        _join_at_once(recordings),
        max(recording.pole_step_rad for recording in recordings),
    )


def _pick_latency(recordings: Sequence[Recording]) -> CommandLatency | None:
    """Return the latency of commands that is known worst; None where no recording says it."""
    known = [r.command_latency for r in recordings if r.command_latency is not None]
    return max(known, key=lambda latency: latency.spread_s or 0.0, default=None)


def _join_signals(recordings: Sequence[Recording]) -> Signals:
    try:
        return join_signals([recording.signals for recording in recordings])
    except BadInputError as error:
        raise WrongUse(str(error)) from error


def _join_rates(recordings: Sequence[Recording]) -> Floats | None:
    """Return the reported velocities, (n, 2); None unless all recordings report some."""
    rates = [recording.rates for recording in recordings if recording.rates is not None]
    return np.concatenate(rates) if len(rates) == len(recordings) else None


def _join_at_once(recordings: Sequence[Recording]) -> Floats | None:
    """Return the commands as they act at once, (n,); None where they are the same in each."""
    if all(recording.at_once is None for recording in recordings):
        return None
    return np.concatenate(
        [r.signals.command if r.at_once is None else r.at_once for r in recordings]
    )


def _join_findings(recordings: Sequence[Recording]) -> tuple[QualityFinding, ...]:
    """Return the findings of all recordings, one a kind, at times counted through all of them."""
    joined: dict[str, QualityFinding] = {}
    notes: dict[str, dict[str, None]] = {}  # of each kind, each note once
    begin_s, uneven = 0.0, _compare_periods(recordings)
    for recording in recordings:
        for finding in recording.findings:
            earlier = joined.get(finding.kind, QualityFinding(finding.kind, 0))
            intervals_s = tuple((begin_s + a, begin_s + b) for a, b in finding.intervals_s)
            joined[finding.kind] = replace(
                earlier,
                count=earlier.count + finding.count,
                intervals_s=earlier.intervals_s + intervals_s,
            )
            notes.setdefault(finding.kind, {})[finding.note] = None
        begin_s += recording.signals.end_s
    return uneven + tuple(
        replace(finding, note="; ".join(filter(None, notes[kind])))
        for kind, finding in joined.items()
    )


def _compare_periods(recordings: Sequence[Recording]) -> tuple[QualityFinding, ...]:
    """Return what is wrong where samples stand on the clock of the first recording, if anything.

    Speeds are then off by the difference of the periods, and so are the constants.
    """
    first = recordings[0].signals.period_s
    differences = [abs(each.signals.period_s / first - 1.0) for each in recordings]
    count = sum(difference >= PERIODS_DIFFER for difference in differences)
    if not count:
        return ()
    note = (
        f"samples stand on the clock of the first recording, {1e3 * first:.5g} ms, and their own "
        f"periods are off by up to {max(differences):.2%}: so are speeds; diagnose recordings of "
        "each rate apart where this matters"
    )
    return (QualityFinding("other_rate", count, note=note),)
