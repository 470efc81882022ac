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
    first = np.array([piece[0] for piece in kept])
    clock_s, times_s = signals.clock_s[first], signals.times_s[first]
    stretch_begins = np.cumsum([0, *(stop - begin for begin, stop in kept[:-1])])
    fewer = replace(
        signals,
        command=signals.command[at],
        parts=None if signals.parts is None else signals.parts[at],
        cart=None if signals.cart is None else signals.cart[at],
        pole=None if signals.pole is None else signals.pole[at],
        cart_valid=signals.cart_valid[at],
        pole_valid=signals.pole_valid[at],
        stretch_begins=tuple(int(s) for s in stretch_begins),
        begin_s=tuple(clock_s.tolist()),
        after_s=tuple((times_s - clock_s).tolist()),
    )
    state = replace(
        case.state, states=case.state.states[at], accelerations=case.state.accelerations[at]
    )
    rates = None if case.recording.rates is None else case.recording.rates[at]
    return replace(
        case,
        recording=replace(case.recording, signals=fewer, rates=rates, doubt=None),
        state=state,
    )
