"""Ask before any search whether a recording can be one of its twin's rig: units, columns, zeros.

A search explains whatever it is given: a recording in millimetres ends as dry friction of 597 N.
Each check puts one question to recording and twin, and names the option that mends a wrong answer.
Range alone convicts nothing: an answer is `no` only where the motion itself obeys the pole's
equation in another unit, about another zero or in other columns, and does not as it stands.
Wrong signs, scales, offsets and constants are no matter of plausibility: the search finds them.
"""

from __future__ import annotations

from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.plausibility.angle_checks import check_pole_columns, check_pole_zero
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.balances import balance_pole, measure_gain
from pendulum_sysid.plausibility.drive_checks import (
    check_cart_range,
    check_command_range,
    check_drive,
)
from pendulum_sysid.plausibility.rig_checks import check_one_rig
from pendulum_sysid.plausibility.time_checks import (
    check_frequency,
    check_gravity,
    check_rate,
)


def check_plausibility(case: Case) -> tuple[Check, ...]:
    """Return the answers to all questions that recording and twin allow, the gravest first."""
    signals, state = case.signals, case.state
    as_it_is = balance_pole(signals, state)
    gain = measure_gain(signals, state)
    checks = (
        check_rate(signals),
        check_pole_columns(case, as_it_is),
        check_cart_range(case, as_it_is, gain),
        check_command_range(case, gain),
        check_pole_zero(case, as_it_is),
        check_one_rig(case),
        check_frequency(case, as_it_is),
        check_gravity(case, as_it_is),
        check_drive(case, gain),
    )
    return tuple(check for check in checks if check is not None)


def list_plausibility_doubts(case: Case) -> tuple[str, ...]:
    """Return a sentence for each check whose answer is a doubt, as a warning beside the answer.

    Raises UnusableRecording with the sentence of the first check whose answer is no.
    """
    checks = check_plausibility(case)
    for check in checks:
        if check.answer is CheckAnswer.NO:
            raise UnusableRecording(check.sentence, case.recording)
    return tuple(_describe(check) for check in checks if check.answer is CheckAnswer.DOUBT)


def list_plausibility_warnings(case: Case) -> tuple[str, ...]:
    """Return a sentence for each check whose answer is a doubt or a no."""
    doubted = (CheckAnswer.DOUBT, CheckAnswer.NO)
    return tuple(_describe(c) for c in check_plausibility(case) if c.answer in doubted)


def _describe(check: Check) -> str:
    answer = "Doubtful" if check.answer is CheckAnswer.DOUBT else "No"
    return f"{check.question} {answer}: {check.sentence}."
