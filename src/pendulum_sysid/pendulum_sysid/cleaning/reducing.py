"""Reduce the rate of recordings that are faster than a rig can move: every so-many-th sample.

A pendulum moves no faster than some 10 Hz. Samples beyond 1 kHz tell less noise, and no more
motion; smoothing and fits then take as long, in s, as at 1 kHz. Samples are picked and not
averaged: means of an encoder that hardly moves have finer steps than the encoder, and look more
exact than they are.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.signals import Signals


def is_too_fast(signals: Signals) -> bool:
    """Return whether the signals are faster than `MOST_RATE_HZ`."""
    return _count_samples(signals) > 1


def _count_samples(signals: Signals) -> int:
    """Return the length of a block, of which the first sample is kept."""
    return math.ceil(1.0 / (signals.period_s * decisions.MOST_RATE_HZ) - 0.01)


def reduce_rate(signals: Signals) -> Signals:
    """Return signals of at most `MOST_RATE_HZ`; those that are slower come back as they are.

    The first sample of each block is kept, with the mean command of the block.
    """
    if not is_too_fast(signals):
        return signals
    count = _count_samples(signals)
    blocks = [
        s.start + count * np.arange((s.stop - s.start) // count)[:, None] + np.arange(count)
        for s in signals.stretches
    ]
    blocks = [block for block in blocks if len(block) >= decisions.SHORTEST_STRETCH]
    rows = np.concatenate([np.empty((0, count), dtype=np.int64), *blocks])
    kept = rows[:, 0]
    return replace(
        signals,
        period_s=count * signals.period_s,
        command=signals.command[rows].mean(axis=1),
        cart=None if signals.cart is None else signals.cart[kept],
        pole=None if signals.pole is None else signals.pole[kept],
        cart_valid=signals.cart_valid[kept],
        pole_valid=signals.pole_valid[kept],
        stretch_begins=tuple(np.cumsum([0, *(len(block) for block in blocks[:-1])]).tolist()),
        begin_s=tuple(signals.clock_s[[block[0, 0] for block in blocks]].tolist()),
        after_s=None,
        parts=None,
    )
