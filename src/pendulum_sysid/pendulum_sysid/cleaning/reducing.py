"""Reduce the rate of recordings that are faster than a rig can move: means of samples.

A pendulum moves no faster than some 10 Hz. Beyond 1 kHz further samples only tell less noise,
which a mean of neighbours keeps; smoothing and fits then take as long, in s, as at any rate.
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals


def reduce_rate(signals: Signals) -> Signals:
    """Return signals of at most `MOST_RATE_HZ`; those that are slower come back as they are.

    A sample becomes the mean of its block, at the block's middle, and its command the mean from
    there to the next. A block is valid when most of its samples are.
    """
    count = math.ceil(1.0 / (signals.period_s * decisions.MOST_RATE_HZ) - 0.01)
    if count < 2:
        return signals
    blocks = [
        s.start + count * np.arange((s.stop - s.start) // count)[:, None] + np.arange(count)
        for s in signals.stretches
    ]
    kept = [k for k, block in enumerate(blocks) if len(block) >= decisions.SHORTEST_STRETCH]
    rows = np.concatenate([blocks[k] for k in kept])
    middle = (count - 1) / 2.0
    ends = np.concatenate([np.full(len(blocks[k]), signals.stretches[k].stop - 1) for k in kept])
    later = np.minimum(rows + round(middle), ends[:, None])
    lengths = [len(blocks[k]) for k in kept]
    clock = signals.clock_s
    return replace(
        signals,
        period_s=count * signals.period_s,
        command=signals.command[later].mean(axis=1),
        cart=_take_mean(signals.cart, rows),
        pole=_take_mean(signals.pole, rows),
        cart_valid=signals.cart_valid[rows].mean(axis=1) > 0.5,
        pole_valid=signals.pole_valid[rows].mean(axis=1) > 0.5,
        stretch_begins=tuple(int(n) for n in np.cumsum([0, *lengths[:-1]])),
        begin_s=tuple(float(clock[blocks[k][0, 0]]) + middle * signals.period_s for k in kept),
        after_s=None,
    )


def _take_mean(values: Floats | None, rows: np.ndarray) -> Floats | None:
    return None if values is None else values[rows].mean(axis=1)
