"""Samples at the start of a recording that do not belong to it: the cart does not answer the command yet.

Logging often starts before the drive does, or with what an earlier run left in the buffers. Such samples look like a delay,
a dead zone or heavy friction, and no physics repairs them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.records import QualityFinding, Recording
from pendulum_sysid.windows import SmoothState, smooth_state
from pendulum_twin.signals import Floats, Signals

EARLY = 0.25  # only this part of a stretch, from its start, is suspected
LONG_S = 0.2  # shorter silences are left to delay, lag and dry friction
STRONG = 0.35  # of the largest command: what the cart must have been told meanwhile
CERTAIN = 50.0  # log likelihood by which the silence must beat an answer
AT_REST = 0.05  # of the root mean square speed


@dataclass(frozen=True)
class Answer:
    """Hold the cart's acceleration as a linear answer, by least squares: drive a unit command, brakes, and what is left."""

    drive: float
    brakes: Floats
    spread: float


def without_unanswered(recording: Recording) -> Recording:
    """Return the recording with what goes before the first answer marked as not valid, and the finding added.

    Nothing is said of a recording without a cart or a command.
    """
    signals = recording.signals
    if signals.cart is None or not np.any(signals.command):
        return recording
    state = smooth_state(signals)
    answer = _answer(signals, state)
    ends = [(s.start, s.start + _silent_samples(signals, state, s, answer)) for s in signals.stretches]
    found = [(begin, end) for begin, end in ends if end > begin]
    if not found:
        return recording
    valid = np.ones(len(signals), dtype=bool)
    for begin, end in found:
        valid[begin:end] = False
    cleaned = replace(
        signals,
        cart_valid=signals.cart_valid & valid,
        pole_valid=signals.pole_valid & valid,
        starts=tuple(sorted({*signals.starts, *(end for _, end in found)})),
    )
    intervals = tuple((begin * signals.period_s, end * signals.period_s) for begin, end in found)
    stale = QualityFinding("stale", len(found), intervals)
    return replace(recording, signals=cleaned, findings=(*recording.findings, stale))


def _brakes(state: SmoothState) -> Floats:
    """Return what can slow the cart or push it without a command, (n, 3): viscous, dry, constant."""
    v = state.states[:, 2]
    slow = AT_REST * np.sqrt(np.mean(v**2)) + 1e-12
    return np.stack([v, np.tanh(v / slow), np.ones_like(v)], axis=1)


def _answer(signals: Signals, state: SmoothState) -> Answer:
    """Return how the cart answers in the part of every stretch that is not suspected."""
    late = np.concatenate([np.arange(s.start + _early(s), s.stop) for s in signals.stretches])
    columns = np.column_stack([signals.command, _brakes(state)])[late]
    target = state.accelerations[late, 0]
    found = np.linalg.lstsq(columns, target, rcond=None)[0]
    spread = float(np.std(target - columns @ found))
    return Answer(float(found[0]), found[1:], max(spread, 1e-12))


def _early(stretch: slice) -> int:
    return int(EARLY * (stretch.stop - stretch.start))


def _silent_samples(signals: Signals, state: SmoothState, stretch: slice, answer: Answer) -> int:
    """Return for how many samples a stretch is more likely without the drive than with it (a change point by likelihood)."""
    part = slice(stretch.start, stretch.start + _early(stretch))
    command = signals.command[part]
    rest = state.accelerations[part, 0] - _brakes(state)[part] @ answer.brakes
    gain = ((rest - answer.drive * command) ** 2 - rest**2) / (2 * answer.spread**2)
    total = np.cumsum(gain)
    if not len(total):
        return 0
    end = int(np.argmax(total)) + 1
    strong = STRONG * float(np.max(np.abs(signals.command[stretch])))
    long_enough = end * signals.period_s >= LONG_S
    told = float(np.sqrt(np.mean(command[:end] ** 2)))
    return end if long_enough and told > strong and total[end - 1] > CERTAIN else 0
