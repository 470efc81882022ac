"""Find where a command stood at its limit."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_sysid.cleaning.detector import Fault, Samples, list_spans
from pendulum_twin.arrays import Floats


def detect_clipping(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Say where the command stood at its limit."""
    raw = samples.raw
    finite = np.isfinite(raw.command)
    runs = find_clipped_runs(raw.command[finite])
    return samples, (Fault("clipped", list_spans(raw.command_stamp_s[finite], runs)),)


def find_clipped_runs(command: Floats) -> list[tuple[int, int]]:
    """Return the (first, stop) samples at which a command (n,) stood at its greatest magnitude.

    None are returned when it hardly ever stood there. Steps between constant levels are a plan,
    not
    clipping: the command must move towards the limit or away from it.
    """
    limit = float(np.max(np.abs(command), initial=0.0))
    if limit == 0.0:
        return []
    at_limit = np.abs(command) >= limit * (1 - 1e-9)
    clipped = [
        (a, b)
        for a, b in find_runs(at_limit)
        if b - a >= decisions.LIMIT_LEAST_SAMPLES and _glides(command, limit, a, b)
    ]
    samples = sum(b - a for a, b in clipped)
    return clipped if samples > decisions.CLIPPED_SHARE * len(command) else []


def _glides(command: Floats, limit: float, first: int, stop: int) -> bool:
    """Tell whether the command came gradually to the limit or left it so."""
    sides = (command[max(0, first - 2) : first][::-1], command[stop : stop + 2])
    return any(
        len(side) == 2
        and abs(side[0]) > (1 - decisions.CLIPPED_APPROACH) * limit
        and side[0] * command[first] > 0
        and side[0] != side[1]
        for side in sides
    )
