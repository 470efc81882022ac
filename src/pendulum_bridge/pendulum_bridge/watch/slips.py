"""Find steps in what an encoder shows: the encoder slipped, or its mounting did.

A slip shows at its sample, unlike every other change: the readings step, and the motion goes on.
After a slip of the pole's encoder gravity also seems to pull the wrong way, which `angle_offset`
shows; a slip of the cart's encoder leaves no other trace.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_bridge.watch.evidence import OVERLAP_WEIGHT, Leader, compute_ratios
from pendulum_bridge.watch.noise import WeighedWindow, compute_scores, compute_step_scores
from pendulum_bridge.watch.reading import Reading
from pendulum_twin.arrays import Floats

WORTH_SIZES = np.array([0.002, 0.015])  # m, rad: a slip worth an alarm
CLEAN_MISFIT = 3.0  # times its degrees of freedom: misfit of a window without its step
LEAD = 4.0  # log-likelihood by which a step must explain a window better than any signature


@dataclass(frozen=True)
class Slip:
    """Hold a step of a joint's readings.

    joint: 0 cart, 1 pole.
    leader: its size (m, rad) and its evidence.
    """

    joint: int
    leader: Leader


@dataclass(frozen=True)
class _Remainder:
    """Hold how a window stands without a step.

    misfit: weighed square.
    explained: log-likelihood that the best signature explains.
    rows: of the window.
    """

    misfit: float
    explained: float
    rows: int


class Slips:
    """Look for a step in each window and the one before, which overlap by half.

    joints: that the rig has.
    samples: of a window.
    hop: samples from window to window.
    """

    def __init__(self, joints: tuple[int, ...], samples: int, hop: int) -> None:
        self._joints, self._samples, self._hop = joints, samples, hop
        self.clear()

    def clear(self) -> None:
        """Forget the window before."""
        self._scores: dict[int, tuple[Floats, Floats]] = {}
        self._slot = -1
        self._remainder = _Remainder(0.0, 0.0, 0)

    def look(self, reading: Reading, window: WeighedWindow) -> Slip | None:
        """Return the best step in the half that both windows share, if it explains them."""
        followed = reading.slot == self._slot + self._hop
        scores, remainder = self._scores, self._remainder
        self._scores = {
            joint: compute_step_scores(reading, window, joint, self._samples)
            for joint in self._joints
        }
        self._slot, self._remainder = reading.slot, _measure_remainder(reading, window)
        if not followed:
            return None
        steps = [
            self._find_best(joint, scores[joint], self._scores[joint]) for joint in self._joints
        ]
        slip = max(steps, key=lambda step: step.leader.ratio, default=None)
        if slip is None or not _is_explanation(slip, remainder, self._remainder):
            return None
        return slip

    def _find_best(
        self, joint: int, before: tuple[Floats, Floats], now: tuple[Floats, Floats]
    ) -> Slip:
        score, information = (
            OVERLAP_WEIGHT
            * (b[self._hop + 1 : self._samples + 1] + a[1 : self._samples - self._hop + 1])
            for b, a in zip(before, now, strict=True)
        )
        worth = np.full(1, WORTH_SIZES[joint])
        rising, falling = (compute_ratios(way * score, information, worth) for way in (1.0, -1.0))
        ratio = np.maximum(rising, falling)
        best = int(np.argmax(ratio))
        known = max(float(information[best]), 1e-300)
        leader = Leader(float(ratio[best]), 1, float(score[best]) / known, known**-0.5)
        return Slip(joint, leader)


def _measure_remainder(reading: Reading, window: WeighedWindow) -> _Remainder:
    score, information = compute_scores(reading, window)
    gains = score**2 / np.maximum(np.diag(information), 1e-300)
    explained = OVERLAP_WEIGHT * 0.5 * float(np.max(gains, initial=0.0))
    return _Remainder(window.misfit, explained, len(window.off))


def _is_explanation(slip: Slip, before: _Remainder, now: _Remainder) -> bool:
    """Tell whether a step leaves both windows clean and beats every signature."""
    gain = (slip.leader.size / slip.leader.deviation) ** 2  # both windows at half weight
    misfit = OVERLAP_WEIGHT * (before.misfit + now.misfit)
    rows = OVERLAP_WEIGHT * (before.rows + now.rows)
    is_clean = misfit - gain < CLEAN_MISFIT * rows
    return is_clean and gain / 2 > before.explained + now.explained + LEAD
