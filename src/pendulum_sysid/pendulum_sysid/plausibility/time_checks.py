"""Whether the times count seconds: by the rate of the samples, and by the pole's swing."""

from __future__ import annotations

import math

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.balances import PoleBalance
from pendulum_sysid.plausibility.swings import swings_widely
from pendulum_sysid.plausibility.units import (
    TIME_UNITS,
    advise_option,
    compute_own_gravity,
    is_near,
    pick_unit,
)
from pendulum_twin.signals import Signals


def check_rate(signals: Signals) -> Check:
    """Ask whether samples come at a rate that a rig can have."""
    rate_hz, question = 1.0 / signals.period_s, "Do the times count seconds?"
    lowest, highest = decisions.LOWEST_RATE_HZ, decisions.HIGHEST_RATE_HZ
    expected = f"{lowest:g} to {highest:g} samples a second"
    observed = f"{rate_hz:.4g} in {signals.seconds:.4g} s"
    if lowest <= rate_hz <= highest:
        return Check(question, CheckAnswer.YES, expected, observed)
    units = [
        unit
        for unit, count in TIME_UNITS.items()
        if decisions.USUAL_LEAST_RATE_HZ <= rate_hz * count <= highest
    ]
    advice = advise_option(units[0], "or --rate HZ for numbered rows") if units else ""
    return Check(
        question, CheckAnswer.NO, expected, observed, advice or "check the column of the times"
    )


def check_frequency(case: Case, balance: PoleBalance) -> Check | None:
    """Ask whether the hanging pole swings at its own frequency."""
    if balance.explained < decisions.BALANCE_SURE or not swings_widely(case.signals):
        return None
    own, observed = (math.sqrt(k) / math.tau for k in (compute_own_gravity(case), balance.gravity))
    question = "Does the hanging pole swing at its own frequency?"
    words = f"about {own:.3g} Hz by the twin file", f"{observed:.3g} Hz"
    if is_near(balance, case, decisions.FREQUENCY_DOUBT):
        return Check(question, CheckAnswer.YES, *words)
    option = pick_unit(own / observed, TIME_UNITS)
    if option is not None:
        return Check(question, CheckAnswer.NO, *words, advise_option(option))
    advice = (
        "check that this is the twin of this rig, the unit of the times, com_distance_m (of cart "
        "and pole together) and pole_inertia_kg_m2 (about the axis) of the twin file"
    )
    return Check(question, CheckAnswer.DOUBT, *words, advice)


def check_gravity(case: Case, balance: PoleBalance) -> Check | None:
    """Ask whether lengths and times together show the acceleration of gravity.

    It does not depend on the rig: a recording in half seconds shows a quarter of it.
    """
    if balance.explained < decisions.BALANCE_SURE or not swings_widely(case.signals):
        return None
    own = case.twin.rig.gravity_m_s2
    least, most = balance.gravity_m_s2
    if not least > 0.0:
        return None
    question = "Do lengths and times agree with gravity?"
    observed = f"{most:.3g} m/s^2" if most < 1.05 * least else f"{least:.3g} to {most:.3g} m/s^2"
    words = f"gravity of {own:.3g} m/s^2", observed
    ratio = max(least / own, own / most)
    if ratio <= decisions.GRAVITY_FACTOR:
        return Check(question, CheckAnswer.YES, *words)
    advice = (
        "check --rate and the units of times and positions (times twice too long show a quarter), "
        "and gravity_m_s2 of the twin file"
    )
    answer = CheckAnswer.NO if ratio > decisions.GRAVITY_CERTAIN else CheckAnswer.DOUBT
    return Check(question, answer, *words, advice)
