"""Windows that do not look like the rig at all, whatever the reason.

A large change is not linear in anything: a cart that has begun to stick has scores of either sign,
while every window is far off. So windows whose misfit is beyond all scatter are counted, and a row
of them has the rivals tried at full size.
"""

from __future__ import annotations

import numpy as np

from pendulum_bridge.watch.noise import Weighed
from pendulum_bridge.watch.reading import Reading

STRANGE = 4.0  # times its degrees of freedom: a window's misfit beyond it is strange
ROW = 5  # strange windows, less those that were not: half of each is new, so that it takes three separate ones


class Strangeness:
    """Count strange windows, and how far each joint was off in them."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._count = self.since = self._rows = 0
        self._off = np.zeros(2)

    def add(self, reading: Reading, window: Weighed) -> None:
        """Take a window."""
        strange = window.misfit > STRANGE * len(window.off)
        self._count = min(self._count + 1, 2 * ROW) if strange else self._count - 1
        if self._count <= 0:
            self.clear()
            return
        self.since += 1
        if strange:
            self._rows += len(window.off)
            self._off += np.bincount(reading.joint, window.off * window.times(window.off), 2)

    @property
    def tripped(self) -> bool:
        """Tell whether it is time to ask what has changed."""
        return self._count >= ROW

    @property
    def worst(self) -> tuple[int, float]:
        """Return the joint that is further off (0 cart, 1 pole), and how many times its usual scatter the rig is off."""
        return int(np.argmax(self._off)), float(
            np.sqrt(max(np.sum(self._off), 0.0) / max(self._rows, 1))
        )
