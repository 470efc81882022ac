"""A recording that starts too early: its first samples are stale, its commands do not act."""

from __future__ import annotations

import math

import numpy as np

COMMAND_PWM, COMMAND_HZ = 0.15, 0.8  # of the commands that have no effect


def count_stale_samples(seconds: float, period_s: float) -> int:
    """Return how many samples are stale: those stamped before `seconds`."""
    return math.ceil(seconds / period_s - 1e-9)


def draw_earlier_state(start: tuple[float, ...], seed: int) -> tuple[float, ...]:
    """Return the state (x, th, v, w) of cart and pole when a recording begins too early.

    The seed decides whether they stand at the start of the run or still move after an earlier run.
    start: (4,) state from which the run starts.
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
    """Return the command (PWM fraction) that is sent at a time while no command acts."""
    return COMMAND_PWM * math.cos(2 * math.pi * COMMAND_HZ * time_s)
