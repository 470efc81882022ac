"""Count windows that do not look like the rig at all, whatever the reason.

A large change is linear in nothing: a cart that has begun to stick has scores of either sign,
while every window is far off. So windows whose misfit is beyond all scatter are counted, and
several of them in a row have the candidates tried at full size.
"""

from __future__ import annotations

import numpy as np

from pendulum_bridge.watch.noise import WeighedWindow
from pendulum_bridge.watch.reading import Reading

STRANGE_MISFIT = 4.0  # times its degrees of freedom: a window's misfit beyond it is strange
STRANGE_WINDOWS = 5  # strange minus usual windows; half of each is new, so it takes three apart


class Strangeness:
    """Count strange windows, and how far each joint was off in them."""

    def __init__(self) -> None:
        self.clear()

    def clear(self) -> None:
        """Begin anew."""
        self._count = self.since = self._rows = 0
        self._off = np.zeros(2)

    def add(self, reading: Reading, window: WeighedWindow) -> None:
        """Take a window."""
        strange = window.misfit > STRANGE_MISFIT * len(window.off)
        self._count = min(self._count + 1, 2 * STRANGE_WINDOWS) if strange else self._count - 1
        if self._count <= 0:
            self.clear()
            return
        self.since += 1
        if strange:
            self._rows += len(window.off)
            self._off += np.bincount(reading.joint, window.off * window.weigh(window.off), 2)

    @property
    def tripped(self) -> bool:
        """Tell whether it is time to ask what has changed."""
        return self._count >= STRANGE_WINDOWS

    @property
    def worst(self) -> tuple[int, float]:
        """Return the joint that is further off (0 cart, 1 pole), and the error of the rig.

        The error is in units of its usual scatter.
        """
        mean_square = max(np.sum(self._off), 0.0) / max(self._rows, 1)
        return int(np.argmax(self._off)), float(np.sqrt(mean_square))
