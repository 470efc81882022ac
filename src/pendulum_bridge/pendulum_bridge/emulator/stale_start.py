"""A recording whose first samples belong to no run, or to an earlier one: what the rig does meanwhile."""

from __future__ import annotations

import math

import numpy as np

OLD_PWM, OLD_HZ = 0.15, 0.8


def count_stale_samples(seconds: float, period_s: float) -> int:
    """Return how many samples do not belong to the run: those stamped before `seconds`."""
    return math.ceil(seconds / period_s - 1e-9)


def draw_earlier_state(start: tuple[float, ...], seed: int) -> tuple[float, ...]:
    """Return where cart and pole are when a recording begins too early.

    They stand where the run will start, or move by themselves, after an earlier run; the seed says
    which.
    """
    random = np.random.default_rng([seed, 2])
    if random.random() < 0.5:
        return start
    return (
        random.uniform(-0.2, 0.2),
        math.pi + random.uniform(0.3, 1.5),
        random.uniform(-0.1, 0.1),
        random.uniform(-2, 2),
    )


def compute_stale_command(time_s: float) -> float:
    """Return a command that was sent while none acted."""
    return OLD_PWM * math.cos(2 * math.pi * OLD_HZ * time_s)
