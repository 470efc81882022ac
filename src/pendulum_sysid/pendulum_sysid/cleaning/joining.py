"""Several recordings of one rig as one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.records import QualityFinding, Recording
from pendulum_twin.signals import join_signals


def join_recordings(recordings: list[Recording]) -> Recording:
    """Return several recordings of one rig as one, each its own stretch; their times follow each other.

    Raises BadInputError when they do not fit together.
    """
    if len(recordings) == 1:
        return recordings[0]
    name, digest = (
        " + ".join(parts) for parts in zip(*((r.name, r.digest) for r in recordings), strict=True)
    )
    rates = None
    if all(one.rates is not None for one in recordings):
        rates = np.concatenate([one.rates for one in recordings if one.rates is not None])
    return Recording(
        name,
        digest,
        join_signals([one.signals for one in recordings]),
        _findings(recordings),
        rates,
    )


def _findings(recordings: list[Recording]) -> tuple[QualityFinding, ...]:
    """Return what the cleaning met in all of them, a kind each, at the times that the samples have in the whole."""
    begins = np.cumsum([0.0, *(one.signals.end_s for one in recordings[:-1])])
    moved = [
        replace(finding, intervals_s=tuple((begin + a, begin + b) for a, b in finding.intervals_s))
        for begin, one in zip(begins.tolist(), recordings, strict=True)
        for finding in one.findings
    ]
    kinds = {
        kind: [one for one in moved if one.kind == kind]
        for kind in dict.fromkeys(one.kind for one in moved)
    }
    return tuple(
        QualityFinding(
            kind,
            sum(one.count for one in same),
            tuple(pair for one in same for pair in one.intervals_s),
        )
        for kind, same in kinds.items()
    )
