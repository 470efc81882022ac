"""Steps in what an encoder shows: it slipped, or its mounting did.

A slip is seen at its sample, unlike every other change: the readings step, and the motion goes on.
After a slip of the pole's encoder gravity also seems to pull the wrong way, which `angle_offset`
shows; a slip of the cart's encoder leaves no other trace.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.watch.evidence import SHARE, Leader, ratios
from pendulum_bridge.watch.noise import Weighed, scores, step_scores
from pendulum_bridge.watch.reading import Reading
from pendulum_twin.arrays import Floats

WORTH = np.array([0.002, 0.015])  # m, rad: a slip worth an alarm
CLEAN = (
    3.0  # times its degrees of freedom, that a window's misfit may have once the step is taken out
)
AHEAD = 4.0  # by which a step must explain a window better than any signature (log-likelihood)


@dataclass(frozen=True)
class Slip:
    """Hold a step of a joint's readings: 0 cart, 1 pole; its size (m, rad) and its evidence."""

    joint: int
    leader: Leader


class Slips:
    """Look for a step in each window and the one before, which overlap by half. hop: samples from window to window."""

    def __init__(self, joints: tuple[int, ...], samples: int, hop: int) -> None:
        self._joints, self._samples, self._hop = joints, samples, hop
        self.clear()

    def clear(self) -> None:
        """Forget the window before."""
        self._before: dict[int, tuple[Floats, Floats]] = {}
        self._slot = -1
        self._left = (0.0, 0.0, 0)

    def look(self, reading: Reading, window: Weighed) -> Slip | None:
        """Return the best step in the half that both windows hold, if it is what explains them."""
        score, information = scores(reading, window)
        other = (
            SHARE
            * 0.5
            * float(np.max(score**2 / np.maximum(np.diag(information), 1e-300), initial=0.0))
        )
        left = (window.misfit, other, len(window.off))
        followed = reading.slot == self._slot + self._hop
        before, before_left = self._before, self._left
        self._before = {j: step_scores(reading, window, j, self._samples) for j in self._joints}
        self._slot, self._left = reading.slot, left
        if not followed:
            return None
        found = [self._best(j, before[j], self._before[j]) for j in self._joints]
        slip = max(found, key=lambda one: one.leader.ratio, default=None)
        return slip if slip is not None and self._explains(slip, before_left, left) else None

    def _best(self, joint: int, before: tuple[Floats, Floats], now: tuple[Floats, Floats]) -> Slip:
        score, information = (
            SHARE * (b[self._hop + 1 : self._samples + 1] + a[1 : self._samples - self._hop + 1])
            for b, a in zip(before, now, strict=True)
        )
        both = np.maximum(
            *(ratios(way * score, information, np.full(1, WORTH[joint])) for way in (1.0, -1.0))
        )
        best = int(np.argmax(both))
        known = max(float(information[best]), 1e-300)
        return Slip(joint, Leader(float(both[best]), 1, float(score[best]) / known, known**-0.5))

    def _explains(
        self, slip: Slip, before: tuple[float, float, int], now: tuple[float, float, int]
    ) -> bool:
        gain = (
            slip.leader.size / slip.leader.deviation
        ) ** 2  # of the misfit, both windows at half weight
        misfit, rows = SHARE * (before[0] + now[0]), SHARE * (before[2] + now[2])
        return misfit - gain < CLEAN * rows and gain / 2 > before[1] + now[1] + AHEAD
