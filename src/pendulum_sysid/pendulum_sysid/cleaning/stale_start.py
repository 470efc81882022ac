"""Find the start of a recording in which the cart does not answer the command yet.

Logging often starts before the drive does, or with what an earlier run left in the buffers. Such
samples look like a delay, a dead zone or heavy friction, and no physics repairs them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.earlier_samples import delay_samples
from pendulum_sysid.cleaning.leaving_out import leave_samples_out
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.records import QualityFinding, Recording
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

DRY = 1  # its column among the brakes
LATER_S = 0.01
NOTE = "the cart does not answer its command yet"


@dataclass(frozen=True)
class LinearAnswer:
    """Hold the cart's acceleration as a linear answer to the command, by least squares.

    late: samples by which the acceleration follows the command.
    drive: m/s^2 a unit of the command.
    brakes: (3,) of viscous and dry friction and of a constant force, see `list_brakes`.
    spread: standard deviation of the remainder, m/s^2.
    """

    late: int
    drive: float
    brakes: Floats
    spread: float


def leave_out_stale_start(recording: Recording, state: SmoothState) -> Recording:
    """Mark as not valid what goes before the cart's first answer, and add the finding.

    Returns the same recording when there is nothing to mark, and when it has no cart or command.
    """
    signals = recording.signals
    if signals.cart is None or not np.any(signals.command):
        return recording
    answer = _fit_answer(signals, state)
    if answer is None:
        return recording
    ends = [
        (s.start, s.start + _count_silent(signals, state, s, answer))
        for s in signals.stretches
        if signals.cart_valid[s].any()
    ]
    spans = [(begin, end) for begin, end in ends if end > begin]
    if not spans:
        return recording
    times = signals.times_s
    intervals = tuple(
        (float(times[begin]), float(times[end - 1]) + signals.period_s) for begin, end in spans
    )
    return leave_samples_out(
        recording, spans, QualityFinding("stale", len(spans), intervals, NOTE)
    )


def list_brakes(state: SmoothState) -> Floats:
    """Return what moves the cart without a command, (n, 3): viscous, dry, constant."""
    v = state.states[:, 2]
    return np.stack([v, np.tanh(v / compute_slow_speed(state)), np.ones_like(v)], axis=1)


def compute_slow_speed(state: SmoothState) -> float:
    """Return the speed of a cart that hardly moves, m/s."""
    return float(decisions.REST_SPEED_SHARE * np.sqrt(np.mean(state.states[:, 2] ** 2)) + 1e-12)


def _fit_answer(
    signals: Signals, state: SmoothState, up_to: float = np.inf
) -> LinearAnswer | None:
    """Fit the cart's answer where it is not suspected, with the delay that fits best.

    up_to: larger commands are left out.

    None where nothing moves or too few samples are left.
    """
    late_part = np.concatenate(
        [np.arange(s.start + _count_suspected(signals, s), s.stop) for s in signals.stretches]
    )
    moving = late_part[
        np.abs(state.states[late_part, 2]) > compute_slow_speed(state)
    ]  # at rest, friction takes any value
    if not len(moving):
        return None
    brakes = list_brakes(state)
    step = max(round(LATER_S / signals.period_s), 1)
    answers = []
    for late in range(0, round(decisions.ANSWER_LATEST_S / signals.period_s) + 1, step):
        command = delay_samples(signals.command, late, signals.stretch_begins)
        trusted = moving[np.abs(command[moving]) <= up_to]
        if len(trusted) < decisions.STALE_COMPARABLE_S / signals.period_s and np.isfinite(up_to):
            return None
        columns, target = (
            np.column_stack([command[trusted], brakes[trusted]]),
            state.accelerations[trusted, 0],
        )
        coefficients = np.linalg.lstsq(columns, target, rcond=None)[0]
        spread = float(np.std(target - columns @ coefficients))
        answers.append(
            LinearAnswer(late, float(coefficients[0]), coefficients[1:], max(spread, 1e-12))
        )
    return min(answers, key=lambda answer: answer.spread)


def _count_suspected(signals: Signals, stretch: slice) -> int:
    """Return how many samples of a stretch are suspected: all, where it ends early enough."""
    within = min(stretch.stop, int(decisions.STALE_SHARE * len(signals))) - stretch.start
    return max(int(decisions.STALE_SHARE * (stretch.stop - stretch.start)), within)


def _count_silent(
    signals: Signals, state: SmoothState, stretch: slice, answer: LinearAnswer
) -> int:
    """Return for how many samples a stretch is likelier without the drive than with it.

    This is a change point by likelihood. Weak commands may go unanswered for a dead zone, too:
    then commands as weak must be answered later on.
    """
    end = _find_silence(signals, state, stretch, answer)
    if not end:
        return 0
    delayed = delay_samples(signals.command, answer.late, signals.stretch_begins)
    commanded = np.abs(delayed[stretch.start : stretch.start + end])
    if np.sqrt(np.mean(commanded**2)) > decisions.STALE_COMMAND_SHARE * np.max(
        np.abs(signals.command[stretch])
    ):
        return end
    to_weak = _fit_answer(signals, state, up_to=float(np.max(commanded)))
    return 0 if to_weak is None else min(end, _find_silence(signals, state, stretch, to_weak))


def _find_silence(
    signals: Signals, state: SmoothState, stretch: slice, answer: LinearAnswer
) -> int:
    """Return for how many samples silence is likelier than the answer; 0 where it is not sure.

    A cart that has surely answered is not silent later: what its pole does to a light cart for a
    while, against the command, is no silence.
    """
    part = slice(stretch.start, stretch.start + _count_suspected(signals, stretch))
    command = delay_samples(signals.command, answer.late, signals.stretch_begins)[part]
    remainder = state.accelerations[part, 0] - list_brakes(state)[part] @ answer.brakes
    still = np.abs(state.states[part, 2]) < compute_slow_speed(state)
    gripped = still & (
        np.abs(answer.drive * command) < decisions.STALE_GRIP * np.abs(answer.brakes[DRY])
    )
    gain = np.where(gripped, 0.0, (remainder - answer.drive * command) ** 2 - remainder**2) / (
        2 * answer.spread**2
    )
    total = np.cumsum(gain)
    if not len(total):
        return 0
    fallen = np.maximum.accumulate(np.maximum(total, 0.0)) - total > decisions.STALE_NATS
    if fallen.any():
        total = total[: int(np.argmax(fallen)) + 1]
    end = len(total) - int(np.argmax(total[::-1]))  # the last of equal ones: a grip proves nothing
    long_enough = end * signals.period_s >= decisions.STALE_LEAST_S
    return end if long_enough and total[end - 1] > decisions.STALE_NATS else 0
