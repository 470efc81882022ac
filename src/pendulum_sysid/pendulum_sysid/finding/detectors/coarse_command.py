"""Find the step of a drive that knows few steps of the command.

A run knows nothing of a step that is far off: each command is then rounded to another side. The
balance of the force judges every step at once.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.detectors.force_waves import TRIED_AT_ONCE, take_out
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import coarse_command, input_sign_inverted
from pendulum_twin.parameter_vector import FORCE_PER_PWM, SLOTS

EFFECT = coarse_command.EFFECT
# Of the largest command: from 40 steps to either side, which the encoders hardly see, to one.
STEPS = np.geomspace(0.025, 1.0, 400)
AROUND = np.linspace(-0.01, 0.01, 101)  # of a step, to either side of the best of these


@dataclass(frozen=True)
class Places:
    """Hold places along a recording from which values are held for a period.

    first, after: (n,) the samples before and after each place.
    rest, part: (n,) shares of the period in which the first and the other value is held.
    """

    first: Ints
    after: Ints
    rest: Floats
    part: Floats

    def take_mean(self, values: Floats) -> Floats:
        """Return the mean of values (n, k) over the period from each place on."""
        first, after = values.take(self.first, axis=0), values.take(self.after, axis=0)
        mean: Floats = self.rest[:, None] * first + self.part[:, None] * after
        return mean


def read_step(sight: Sight) -> tuple[Reading, ...]:
    """Return the step that explains most of the cart's missing force; none without a command."""
    case, theta, balance = sight.thinned, sight.theta, sight.force
    most = float(np.max(np.abs(case.signals.command), initial=0.0))
    if balance is None or most <= 0.0:
        return ()
    mirrored = bool(theta[SLOTS[input_sign_inverted.EFFECT.name]])
    force_n = float(theta[FORCE_PER_PWM]) * (-1.0 if mirrored else 1.0)
    places = _find_places(case, theta)
    own = np.linalg.qr(balance.turned)[0]
    lacking = take_out(own, balance.lacking)

    def explain(steps: Floats) -> Floats:
        """Return how much of the missing force the rounding to each step (k,) explains, (k,)."""
        columns = force_n * _compute_rounding(case.signals.command, places, steps)
        rounding = take_out(own, balance.sieve(columns))
        likeness, size = lacking @ rounding, np.sum(rounding**2, axis=0)
        explained: Floats = np.maximum(likeness, 0.0) ** 2 / np.where(size > 0.0, size, np.inf)
        return explained

    best = _find_best(explain, most * STEPS)
    best = _find_best(explain, best * (1.0 + AROUND))
    return (Reading(EFFECT.name, (best,)),)


def _find_best(explain: Callable[[Floats], Floats], steps: Floats) -> float:
    """Return the first of the steps that explain most, a few being tried at once."""
    pieces = np.array_split(steps, -(-len(steps) // TRIED_AT_ONCE))
    return float(steps[int(np.argmax(np.concatenate([explain(piece) for piece in pieces])))])


def _find_places(case: Case, theta: Floats) -> tuple[Places, Places]:
    """Return the periods after and before each sample, as late as the twin's command."""
    late = sum(float(theta[SLOTS[name].start]) for name in ("input_delay", "motor_lag"))
    count = len(case.signals.command)
    at: Floats = np.arange(count, dtype=np.float64) - late / case.signals.period_s
    return _make_places(at, count), _make_places(at - 1.0, count)


def _make_places(at: Floats, count: int) -> Places:
    inside = np.clip(at, 0.0, count - 1.0)
    first = np.floor(inside).astype(np.int64)
    part = inside - first
    return Places(first, np.minimum(first + 1, count - 1), 1.0 - part, part)


def _compute_rounding(command: Floats, places: tuple[Places, Places], steps: Floats) -> Floats:
    """Return what the rounding to steps (k,) adds to the command (n,) around samples, (n, k)."""
    sent = command[:, None]
    added: Floats = steps * np.floor(sent / steps + 0.5) - sent  # the effect's law, of an array
    after, before = (place.take_mean(added) for place in places)
    around: Floats = 0.5 * (after + before)
    return around


DETECTOR = Detector(EFFECT, Use.START, read_step)
