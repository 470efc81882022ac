"""Find where a command stood at its limit."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.clock import find_runs
from pendulum_twin.signals import Floats


def find_clipped_runs(command: Floats) -> list[tuple[int, int]]:
    """Return (first, stop) samples at which a varying command (n,) stood at its greatest magnitude; [] if hardly ever.

    Steps between constant levels are a plan, not clipping: the command must move towards the limit
    or away from it.
    """
    limit = float(np.max(np.abs(command), initial=0.0))
    if limit == 0.0:
        return []
    at_limit = np.abs(command) >= limit * (1 - 1e-9)
    found = [
        (a, b)
        for a, b in find_runs(at_limit)
        if b - a >= decisions.CLIPPED_LEAST_SAMPLES and _glides(command, limit, a, b)
    ]
    return found if sum(b - a for a, b in found) > decisions.CLIPPED_SHARE * len(command) else []


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
