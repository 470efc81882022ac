"""Ask for waves in what is left: over time (a vibration), along the rail, round the axis."""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.localisation.balance import Balance, Motion
from pendulum_sysid.finding.localisation.questions import MISSING, UNITS, Cost, Measured, Question
from pendulum_sysid.finding.localisation.sieve import FORCE
from pendulum_twin.arrays import Floats

POINTS = 25  # drawn, of one period
WAVES = (4.0, 50.0)  # along the rail, fewest and most that are tried
NOTCHES = (3, 24)  # round the pole's axis
MOST_ROWS = 5000


def make_wave_questions(balance: Balance, here: Motion, residual: Floats) -> list[Question]:
    """Return the questions for the sharpest line over time and the best wave over the position.

    residual: (rows,) what is left of the balance.
    """
    place = "cart" if balance.equation == FORCE else "pole"
    name, values = (
        ("cart_position", here.x) if balance.equation == FORCE else ("pole_angle", here.th)
    )
    questions = []
    hertz = find_vibration_hz(balance, residual)
    if hertz is not None:
        questions.append(
            _make_wave(
                "frequency",
                "frequency",
                place,
                2 * np.pi * hertz,
                here.t,
                balance.equation,
                "time",
            )
        )
    number = _find_wavenumber(values[balance.sieve.at], residual, balance.equation)
    if number is not None:
        questions.append(
            _make_wave(f"{name} wave", name, place, number, values, balance.equation, name)
        )
    return questions


def _make_wave(
    key: str,
    variable: str,
    place: str,
    wavenumber: float,
    values: Floats,
    equation: int,
    axis: str,
) -> Question:
    def make_columns() -> Floats:
        return np.stack([np.sin(wavenumber * values), np.cos(wavenumber * values)], axis=1)

    x = np.linspace(0.0, 2 * np.pi / wavenumber, POINTS)
    drawn = np.stack([np.sin(wavenumber * x), np.cos(wavenumber * x)], axis=1)
    measured = Measured(MISSING[equation], UNITS[equation], axis)
    return Question(
        key, variable, place, Cost.NUMBER, measured, make_columns, x, drawn, bends=False
    )


def find_vibration_hz(balance: Balance, residual: Floats) -> float | None:
    """Return the frequency of the line that stands out most in the spectrum of a rest (rows,)."""
    step = balance.spacing_s
    slot = np.round((balance.seconds - balance.seconds[0]) / step).astype(int)
    even = np.zeros(slot[-1] + 1)
    even[slot] = residual
    power = np.abs(np.fft.rfft(even * np.hanning(len(even)), 4 * len(even))) ** 2
    hertz = np.fft.rfftfreq(4 * len(even), step)
    width = max(int(decisions.LINE_BAND_HZ / hertz[1]), 8)
    if len(power) < 4 * width:
        return None
    at = np.arange(0, len(power), max(width // 4, 1))
    usual = np.interp(
        np.arange(len(power)), at, [np.median(power[max(k - width, 0) : k + width]) for k in at]
    )
    candidate = (hertz > decisions.LINE_LEAST_PERIODS / (len(even) * step)) & (
        power > decisions.LINE_LEAST_POWER * power.max()
    )
    if not candidate.any():
        return None
    return float(
        hertz[int(np.argmax(np.where(candidate, power / np.maximum(usual, 1e-300), 0.0)))]
    )


def _find_wavenumber(values: Floats, residual: Floats, equation: int) -> float | None:
    """Return the wavenumber of the wave over a variable that explains most of a rest (rows,).

    In rad per unit of the values.
    """
    travel = float(np.ptp(values))
    if travel <= 0 or len(values) < 4 * WAVES[1]:
        return None
    tried = (
        2 * np.pi * np.arange(*WAVES, 0.25) / travel
        if equation == FORCE
        else np.arange(*NOTCHES) * 1.0
    )
    thin = slice(None, None, -(-len(values) // MOST_ROWS))
    phase = tried[:, None] * values[thin]
    power = (np.sin(phase) @ residual[thin]) ** 2 + (np.cos(phase) @ residual[thin]) ** 2
    return float(tried[int(np.argmax(power))])
