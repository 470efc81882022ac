"""Samples some time ago, within their stretch: no command reaches over a break in the recording.

At a break nobody knows what was commanded before: another recording begins, or samples are lost.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pendulum_twin.arrays import Floats, Ints


def find_earlier_samples(samples: Ints, late: int | Ints, stretch_begins: Sequence[int]) -> Ints:
    """Return which sample lies so many samples before each, in the shape of both together.

    Where the stretch began later than that, it is the first sample of the stretch.

    samples: numbers of samples.
    late: by how many samples, 0 or more; broadcast with `samples`.
    stretch_begins: first sample of every stretch, rising from 0, as in `Signals`.
    """
    stretches = np.searchsorted(stretch_begins, samples, side="right") - 1
    earlier: Ints = np.maximum(samples - late, np.asarray(stretch_begins)[stretches])
    return earlier


def delay_samples(values: Floats, late: int, stretch_begins: Sequence[int]) -> Floats:
    """Return the values (n,) of so many samples ago; the first one holds before a stretch."""
    return values[find_earlier_samples(np.arange(len(values)), late, stretch_begins)]
