"""Thin out a long recording: some twenty minutes show what a mismatch depends on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case

PIECE_S = 20.0


def thin_out(case: Case, most: int | None = None) -> Case:
    """Return the case with at most so many samples, in whole pieces of the recording.

    Each piece is a stretch of its own, at its own time.
    """
    signals = case.signals
    keep = (most or decisions.LOCALISED_SAMPLES) / max(len(signals), 1)
    if keep >= 1.0:
        return case
    length = max(round(PIECE_S / signals.period_s), 1)
    pieces = [
        (first, min(first + length, stretch.stop))
        for stretch in signals.stretches
        for first in range(stretch.start, stretch.stop, length)
    ]
    turn = np.floor(np.arange(len(pieces) + 1) * keep)
    kept = [
        piece for piece, now, then in zip(pieces, turn[:-1], turn[1:], strict=True) if then > now
    ]
    at = np.concatenate([np.arange(first, stop) for first, stop in kept])
    state = replace(
        case.state, states=case.state.states[at], accelerations=case.state.accelerations[at]
    )
    rates = None if case.recording.rates is None else case.recording.rates[at]
    return replace(
        case,
        recording=replace(
            case.recording, signals=signals.cut(kept), rates=rates, doubt=None, at_once=None
        ),
        state=state,
    )
