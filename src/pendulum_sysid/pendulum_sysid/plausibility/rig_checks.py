"""Whether all parts of the recordings are of one rig."""

from __future__ import annotations

import math

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.balances import balance_pole
from pendulum_sysid.plausibility.swings import swings_widely


def check_one_rig(case: Case) -> Check | None:
    """Ask whether the hanging pole swings alike in all recordings.

    The frequency belongs to the pole alone: no friction, drive or controller changes it. Each
    stretch without a gap answers for itself; a single stretch is not asked.
    """
    frequencies = list(measure_frequencies(case).items())
    if len(frequencies) < 2:
        return None
    (slow_s, slow), (fast_s, fast) = (
        choose(frequencies, key=lambda entry: entry[1]) for choose in (min, max)
    )
    question = "Are all recordings of one rig?"
    expected = "a hanging pole that swings alike throughout"
    observed = f"{slow:.3g} Hz from {slow_s:.3g} s on, {fast:.3g} Hz from {fast_s:.3g} s on"
    ratio = fast / slow
    if ratio <= decisions.ONE_RIG_FACTOR:
        return Check(question, CheckAnswer.YES, expected, observed)
    advice = "give recordings of one rig, all imported alike"
    answer = CheckAnswer.NO if ratio > decisions.ONE_RIG_CERTAIN else CheckAnswer.DOUBT
    return Check(question, answer, expected, observed, advice)


def measure_frequencies(case: Case) -> dict[float, float]:
    """Return begin -> frequency of the hanging pole, s and Hz, of each stretch that shows it."""
    signals, frequencies = case.signals, {}
    for stretch in signals.stretches:
        if not swings_widely(signals, stretch):
            continue
        balance = balance_pole(signals, case.state, stretch)
        if balance.explained >= decisions.BALANCE_SURE and balance.gravity > 0.0:
            begin_s = float(signals.times_s[stretch.start])
            frequencies[begin_s] = math.sqrt(balance.gravity) / math.tau
    return frequencies
