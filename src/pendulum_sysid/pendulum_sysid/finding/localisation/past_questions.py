"""Ask whether a missing force depends on the past: on late commands, on the way a joint came."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pendulum_sysid.finding.localisation.balance import Balance, Motion
from pendulum_sysid.finding.localisation.questions import (
    MISSING,
    UNITS,
    Cost,
    Measured,
    Question,
    make_number_question,
)
from pendulum_sysid.finding.localisation.sieve import FORCE
from pendulum_twin.arrays import Floats
from pendulum_twin.parameter_vector import FORCE_PER_PWM
from pendulum_twin.signals import Signals

LAGS_S = (0.0, 0.01, 0.02, 0.03, 0.045, 0.065, 0.09, 0.125, 0.17, 0.23, 0.3)
REACHES = (
    0.05,
    0.1,
    0.2,
    0.4,
    0.8,
)  # of a joint's usual swing, over which a force may build up when it turns round


def make_past_questions(
    signals: Signals, here: Motion, balance: Balance, theta: Floats
) -> list[Question]:
    """Return the questions about the past in an equation; theta: (SIZE,) of the twin."""
    if balance.equation != FORCE:
        return _ask_hysteresis(signals, here.th, "pole_angle*pole_rate", "pole", balance.equation)
    questions = _ask_hysteresis(
        signals, here.x, "cart_position*cart_velocity", "cart", balance.equation
    )
    if np.any(signals.command):
        questions += [_ask_delay(signals, float(theta[FORCE_PER_PWM])), _ask_history(signals)]
    return questions


def hold_around(signals: Signals, late: int) -> Floats:
    """Return the mean of the commands before and after each sample, so many samples late."""
    commands = np.empty(len(signals))
    for s in signals.stretches:
        part, at = signals.command[s], np.arange(s.stop - s.start)
        commands[s] = 0.5 * (part[np.maximum(at - late, 0)] + part[np.maximum(at - late - 1, 0)])
    return commands


def _ask_delay(signals: Signals, gain: float) -> Question:
    """Ask for the command's rate: what a force that comes late lacks, to first order."""
    rate = np.zeros(len(signals))
    for s in signals.stretches:
        rate[s] = np.diff(signals.command[s], prepend=signals.command[s.start]) / signals.period_s
    measured = Measured("time by which the force comes late", "s", "constant")
    return make_number_question(
        "command_rate", "command_rate", "drive", measured, rate, -1.0 / (gain or 1.0)
    )


def _ask_history(signals: Signals) -> Question:
    """Ask for the command's past: force per command that has come some time after a step of it."""
    lags = np.unique(np.round(np.array(LAGS_S) / signals.period_s).astype(int))

    def make_columns() -> Floats:
        return np.stack([hold_around(signals, int(lag)) for lag in lags], axis=1)

    measured = Measured("force per command after a step", "N", "lag", 1.0, "drive")
    drawn = np.tril(np.ones((len(lags), len(lags))))
    x = lags * signals.period_s
    return Question(
        "command_history",
        "command_history",
        "drive",
        Cost.PRODUCT,
        measured,
        make_columns,
        x,
        drawn,
        bends=False,
    )


def _ask_hysteresis(
    signals: Signals, values: Floats, variable: str, place: str, equation: int
) -> list[Question]:
    """Ask for a force that builds up with the way since a joint turned, and then stays.

    Brokate and Sprekels, Hysteresis and Phase Transitions (1996), section 2.1.
    """
    usual = float(np.std(values - np.median(values)))
    if usual <= 0:
        return []
    reaches = usual * np.array(REACHES)
    measured = Measured(MISSING[equation], UNITS[equation], "way" if equation == FORCE else "turn")
    x = np.concatenate([[0.0], reaches, [1.5 * reaches[-1]]])
    drawn = np.minimum(x[:, None], reaches) - 0.5 * reaches
    make_columns = _make_stops(signals, values, reaches)
    return [
        Question(
            "hysteresis",
            variable,
            place,
            Cost.PRODUCT,
            measured,
            make_columns,
            x,
            drawn,
            bends=False,
        )
    ]


def _make_stops(signals: Signals, values: Floats, reaches: Floats) -> Callable[[], Floats]:
    def make_columns() -> Floats:
        strains = np.empty((len(values), len(reaches)))
        half = 0.5 * reaches
        for s in signals.stretches:
            steps = np.diff(values[s], prepend=values[s.start])
            now = np.zeros(len(reaches))
            for k, step in enumerate(steps, start=s.start):
                now = np.minimum(np.maximum(now + step, -half), half)
                strains[k] = now
        return strains

    return make_columns
