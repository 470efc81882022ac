"""Ask before any search whether a recording can be one of its twin's rig: units, columns, zeros.

A search explains whatever it is given: a recording in millimetres ends as dry friction of 597 N.
Each check puts one question to recording and twin, and names the option that mends a wrong answer.
Range alone convicts nothing: an answer is `no` only where the motion itself obeys the pole's
equation in another unit, about another zero or in other columns, and does not as it stands.
Wrong signs, scales, offsets and constants are no matter of plausibility: the search finds them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState, smooth_state
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.parameter_vector import (
    COUPLING,
    FORCE_PER_PWM,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    make_theta,
)
from pendulum_twin.signals import Signals

# options of `sysid import`: how many of the unit make one of the twin's
LENGTH_UNITS = {"--length-unit cm": 1e2, "--length-unit mm": 1e3}
TIME_UNITS = {"--time-unit ms": 1e3, "--time-unit us": 1e6, "--time-unit ns": 1e9}
COMMAND_UNITS = {"--command-unit percent": 1e2, "--command-unit per_mille": 1e3}
DEGREES, TURN = 180.0 / math.pi, 2.0 * math.pi


class Answer(Enum):
    """What a check comes to."""

    YES = "yes"
    DOUBT = "doubt"  # worth a look; the diagnosis goes on
    NO = "no"  # the recording cannot be one of this rig as it stands


@dataclass(frozen=True)
class Check:
    """Hold one question to a recording and its twin.

    question: in words.
    answer: yes, doubt or no.
    expected, observed: in words, with units.
    advice: what to do; empty for yes.
    """

    question: str
    answer: Answer
    expected: str
    observed: str
    advice: str = ""

    @property
    def sentence(self) -> str:
        """Return the check as one sentence."""
        said = f"expected {self.expected}, found {self.observed}"
        return f"{said}: {self.advice}" if self.advice else said


@dataclass(frozen=True)
class PoleBalance:
    """Hold how well the pole's equation of motion fits the smoothed angle.

    gravity: 1/s^2, squared frequency of the hanging pole; NaN where it does not show.
    upright_rad: rad, where the pole stands upright, -pi to pi; NaN where gravity does not show.
    coupling: 1/m, angular acceleration by the cart's acceleration; NaN where it does not show.
    explained: share of the angular acceleration's power, 0 to 1.
    """

    gravity: float
    upright_rad: float
    coupling: float
    explained: float

    @property
    def hangs_off_rad(self) -> float:
        """Return how far from pi the pole hangs, 0 to pi; NaN where that does not show."""
        return abs(self.upright_rad)


UNKNOWN = PoleBalance(math.nan, math.nan, math.nan, 0.0)


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
        check_frequency(case, as_it_is),
        check_drive(case, gain),
    )
    return tuple(check for check in checks if check is not None)


def refuse_implausible(case: Case) -> None:
    """Raise UnusableRecording with the sentence of the first check whose answer is no."""
    for check in check_plausibility(case):
        if check.answer is Answer.NO:
            raise UnusableRecording(check.sentence, case.recording)


def check_rate(signals: Signals) -> Check:
    """Ask whether samples come at a rate that a rig can have."""
    rate_hz, question = 1.0 / signals.period_s, "Do the times count seconds?"
    lowest, highest = decisions.LOWEST_RATE_HZ, decisions.HIGHEST_RATE_HZ
    expected = f"{lowest:g} to {highest:g} samples a second"
    observed = f"{rate_hz:.4g} in {signals.seconds:.4g} s"
    if lowest <= rate_hz <= highest:
        return Check(question, Answer.YES, expected, observed)
    units = [
        unit
        for unit, count in TIME_UNITS.items()
        if decisions.USUAL_LEAST_RATE_HZ <= rate_hz * count <= highest
    ]
    advice = _advise(units[0], "or --rate HZ for numbered rows") if units else ""
    return Check(
        question, Answer.NO, expected, observed, advice or "check the column of the times"
    )


def check_pole_columns(case: Case, as_it_is: PoleBalance) -> Check | None:
    """Ask whether the angle's column holds an angle in radians."""
    signals = case.signals
    if signals.pole is None:
        return None
    question, expected = "Is it an angle in radians?", "an angle in rad that moves as a pole does"
    observed = f"{as_it_is.explained:.0%} of its acceleration explained by the pole's equation"
    explained = as_it_is.explained > decisions.BALANCE_UNSURE
    has_known_zero = not (
        decisions.ZERO_DOUBT_RAD < as_it_is.hangs_off_rad < math.pi - decisions.ZERO_CERTAIN_RAD
    )
    if explained and has_known_zero:
        return Check(question, Answer.YES, expected, observed)
    for advice, other in _list_other_readings(signals).items():
        balance = balance_pole(other, smooth_state(other))
        hangs = balance.hangs_off_rad < decisions.ZERO_CERTAIN_RAD or not explained
        sure = balance.explained >= decisions.BALANCE_SURE
        if sure and hangs and _is_near(balance, case, decisions.FREQUENCY_FACTOR):
            observed += f", {balance.explained:.0%} if read otherwise"
            return Check(question, Answer.NO, expected, observed, advice)
    if explained:
        return Check(question, Answer.YES, expected, observed)
    advice = "check the column, unit and scale of --pole"
    return Check(question, Answer.DOUBT, expected, observed, advice)


def _list_other_readings(signals: Signals) -> dict[str, Signals]:
    """Return the signals with the angle in other units, and with both positions exchanged."""
    if signals.pole is None:
        return {}
    degrees = replace(signals, pole=_restore_turns(signals.pole, signals.pole_valid) / DEGREES)
    readings = {_advise("--angle-unit deg"): degrees}
    readings[_advise("--angle-unit turn")] = replace(signals, pole=signals.pole * TURN)
    if signals.cart is not None:
        exchanged = replace(
            signals,
            cart=signals.pole,
            pole=signals.cart,
            cart_valid=signals.pole_valid,
            pole_valid=signals.cart_valid,
        )
        readings["the columns of --cart and --pole are exchanged: import them anew"] = exchanged
    return readings


def _restore_turns(angle: Floats, valid: Mask) -> Floats:
    """Put back the multiples of 2 pi that cleaning took out of the steps of an angle in degrees.

    Speed is continuous, so each step is near the last. A step that is near neither neighbour is a
    spike or a whole turn of 360: the speed carries on over it.
    """
    steps = np.diff(angle)
    changes = np.abs(np.diff(steps) - TURN * np.rint(np.diff(steps) / TURN))
    calm = np.concatenate([[True], changes < decisions.DEGREES_STEP_CHANGE, [True]])
    good = valid[1:] & valid[:-1] & (calm[1:] | calm[:-1])
    if not np.any(good):
        return angle
    at = np.flatnonzero(good)
    followed = np.interp(np.arange(len(steps)), at, np.unwrap(steps[at], period=TURN))
    return angle[0] + np.concatenate([[0.0], np.cumsum(followed)])


def check_cart_range(case: Case, balance: PoleBalance, gain: float) -> Check | None:
    """Ask whether the cart stays on the twin's rail."""
    signals, half = case.signals, case.twin.rig.rail_half_length_m
    if signals.cart is None or half is None or not signals.cart_valid.any():
        return None
    travel = float(np.ptp(signals.cart[signals.cart_valid]))
    ratio = travel / (2 * half)
    question = "Is the cart's position in metres?"
    expected = f"a cart that moves over at most the rail's {2 * half:g} m"
    observed = f"{travel:.4g} m"
    if ratio <= decisions.RAIL_SLACK:
        return Check(question, Answer.YES, expected, observed)
    units = {name: count for name, count in LENGTH_UNITS.items() if ratio / count <= 1.1}
    by_motion = _measure_length_unit(case, balance, gain)
    option = next(iter(units), None) if by_motion is None else _pick_unit(by_motion, units)
    advice = "check the column and unit of --cart, and rail_half_length_m of the twin file"
    advice = _advise(option) if option else advice
    certain = ratio > decisions.RAIL_CERTAIN and option is not None
    answer = Answer.NO if certain or ratio > decisions.RAIL_IMPOSSIBLE else Answer.DOUBT
    return Check(question, answer, expected, observed, advice)


def _measure_length_unit(case: Case, balance: PoleBalance, gain: float) -> float | None:
    """Return how many of the position's unit make a metre, by pole or drive; None if unknown."""
    theta = make_theta(case.twin)
    if balance.explained >= decisions.BALANCE_SURE and balance.coupling > 0.0:
        return float(theta[COUPLING] / theta[INERTIA]) / balance.coupling
    own = float(theta[FORCE_PER_PWM] / theta[MASS])
    return gain / own if gain > 0.0 and own > 0.0 else None


def check_command_range(case: Case, gain: float) -> Check | None:
    """Ask whether the command keeps to the twin's limit."""
    limit, signals = case.twin.rig.pwm_limit, case.signals
    if signals.cart is None or limit is None or not np.any(signals.command):
        return None
    most = float(np.max(np.abs(signals.command)))
    question = "Does the command count as the twin's?"
    expected, observed = f"commands up to the twin's pwm_limit of {limit:g}", f"{most:.4g}"
    if most <= decisions.COMMAND_SLACK * limit:
        return Check(question, Answer.YES, expected, observed)
    units = {name: n for name, n in COMMAND_UNITS.items() if most / limit / n <= 1.1}
    theta = make_theta(case.twin)
    own = float(theta[FORCE_PER_PWM] / theta[MASS])
    ratio = own / gain if gain > 0.0 and own > 0.0 else 1.0
    option = _pick_unit(ratio, units)
    advice = "check the column of --command, and pwm_limit and force_per_pwm_n of the twin file"
    if option is not None:
        advice = _advise(option)
    certain = most > decisions.COMMAND_CERTAIN * limit and ratio > decisions.COMMAND_CERTAIN
    answer = Answer.NO if certain else Answer.DOUBT
    return Check(question, answer, expected, observed, advice)


def check_pole_zero(case: Case, balance: PoleBalance) -> Check | None:
    """Ask whether the pole stands upright at 0."""
    signals = case.signals
    if signals.pole is None:
        return None
    question, expected = "Is the angle 0 upright?", "a pole that hangs at pi and falls away from 0"
    advice = _advise("--pole-zero down", "(with up, if it was imported with down)")
    if balance.explained < decisions.BALANCE_SURE or not _is_near(balance, case, math.inf):
        if not _rests_upright(case):
            return None
        observed = "a pole that rests upright without a command"
        return Check(question, Answer.DOUBT, expected, observed, advice)
    observed = f"a pole that hangs at {(balance.upright_rad + math.pi) % TURN:.3g} rad"
    off_zero = math.pi - balance.hangs_off_rad
    if off_zero >= decisions.ZERO_DOUBT_RAD:
        return Check(question, Answer.YES, expected, observed)
    certain = (
        off_zero < decisions.ZERO_CERTAIN_RAD
        and _is_near(balance, case, decisions.FREQUENCY_FACTOR)
        and _is_coupled(balance, case)
    )
    return Check(question, Answer.NO if certain else Answer.DOUBT, expected, observed, advice)


def _is_coupled(balance: PoleBalance, case: Case) -> bool:
    """Tell whether the cart's acceleration shows in the pole's about as the twin says.

    A controller that holds the pole upright makes cart and angle move as one. Where the cart's
    acceleration is mostly noise, such a pole looks as if it swung about 0, but little coupled.
    """
    if case.signals.cart is None or not np.any(case.state.accelerations[:, 0]):
        return True
    unit = _measure_length_unit(case, balance, math.nan)
    if unit is None:
        return False
    shortfall = min(abs(math.log(unit / count)) for count in (1.0, *LENGTH_UNITS.values()))
    return shortfall <= math.log(decisions.FREQUENCY_FACTOR)


def _rests_upright(case: Case) -> bool:
    """Tell whether the pole stands still near 0 while there is no command."""
    signals, states = case.signals, case.state.states
    samples = max(round(decisions.REST_SECONDS / signals.period_s), 1)
    deviations = case.state.deviations
    still = (
        (signals.command == 0.0)
        & signals.pole_valid
        & (np.abs(np.remainder(states[:, 1] + math.pi, TURN) - math.pi) < decisions.REST_RAD)
        & (np.abs(states[:, 3]) < max(decisions.REST_RAD_S, 3.0 * float(deviations[3])))
    )
    runs = np.convolve(still, np.ones(samples), mode="valid")
    return bool(runs.size and runs.max() >= samples - 0.5)


def check_frequency(case: Case, balance: PoleBalance) -> Check | None:
    """Ask whether the hanging pole swings at its own frequency."""
    if balance.explained < decisions.BALANCE_SURE or not _swings_widely(case):
        return None
    own, observed = (math.sqrt(k) / TURN for k in (_own_gravity(case), balance.gravity))
    question = "Does the hanging pole swing at its own frequency?"
    words = f"about {own:.3g} Hz by the twin file", f"{observed:.3g} Hz"
    if _is_near(balance, case, decisions.FREQUENCY_FACTOR):
        return Check(question, Answer.YES, *words)
    option = _pick_unit(own / observed, TIME_UNITS)
    if option is not None:
        return Check(question, Answer.NO, *words, _advise(option))
    advice = (
        "check the unit of the times, com_distance_m (of cart and pole together) and "
        "pole_inertia_kg_m2 (about the axis) of the twin file"
    )
    return Check(question, Answer.DOUBT, *words, advice)


def _swings_widely(case: Case) -> bool:
    """Tell whether the pole swings so far that a controller and noise cannot pass for gravity."""
    signals = case.signals
    if signals.pole is None or not signals.pole_valid.any():
        return False
    return float(np.ptp(signals.pole[signals.pole_valid])) >= decisions.WIDE_SWING_RAD


def check_drive(case: Case, gain: float) -> Check | None:
    """Ask whether the cart answers a command about as strongly as the twin file says."""
    theta = make_theta(case.twin)
    own = float(theta[FORCE_PER_PWM] / theta[MASS])
    if not (gain > 0.0 and own > 0.0):
        return None
    question = "Is the drive about as strong as the twin's?"
    expected = f"about {own:.3g} m/s^2 a unit of command (force_per_pwm_n over the moved mass)"
    observed = f"{gain:.3g}"
    if abs(math.log(gain / own)) <= math.log(decisions.GAIN_FACTOR):
        return Check(question, Answer.YES, expected, observed)
    advice = "check the units of position and command, and force_per_pwm_n of the twin file"
    return Check(question, Answer.DOUBT, expected, observed, advice)


def balance_pole(signals: Signals, state: SmoothState) -> PoleBalance:
    """Fit w' = k sin(th - th0) + c cos(th - th0) v' - f w to the smoothed motion.

    Least squares, twice: the second time without the rows that the first explains worst.
    """
    if signals.pole is None:
        return UNKNOWN
    angle, rate = state.states[:, 1], state.states[:, 3]
    forward, target = state.accelerations.T
    use = signals.pole_valid & np.isfinite(target) & np.isfinite(angle)
    columns = [np.sin(angle), np.cos(angle), rate]
    if signals.cart is not None and np.any(forward):
        use &= signals.cart_valid
        columns += [np.cos(angle) * forward, np.sin(angle) * forward]
    rows = np.column_stack(columns)
    fit = _fit_robustly(rows, target, use)
    if fit is None:
        return UNKNOWN
    weights, errors, explained = fit
    if math.hypot(*weights[:2]) < decisions.BALANCE_STANDARD_ERRORS * math.hypot(*errors[:2]):
        return replace(UNKNOWN, explained=explained)
    coupling = math.nan
    if len(weights) > 3:
        size, error = math.hypot(*weights[3:]), math.hypot(*errors[3:])
        coupling = size if size >= decisions.BALANCE_STANDARD_ERRORS * error else math.nan
    upright_rad = math.atan2(-weights[1], weights[0])
    return PoleBalance(math.hypot(*weights[:2]), upright_rad, coupling, explained)


def measure_gain(signals: Signals, state: SmoothState) -> float:
    """Return the cart's acceleration by a unit of command, m/s^2; NaN where it does not show."""
    if signals.cart is None or not np.any(signals.command):
        return math.nan
    speed, forward = state.states[:, 2], state.accelerations[:, 0]
    rms = math.sqrt(float(np.mean(speed**2)))
    use = signals.cart_valid & (np.abs(speed) > decisions.REST_SPEED_SHARE * rms)
    rows = np.column_stack([signals.command, speed, np.sign(speed), np.ones_like(speed)])
    fit = _fit_robustly(rows, forward, use)
    if fit is None:
        return math.nan
    weights, errors, _ = fit
    size, error = abs(float(weights[0])), float(errors[0])
    return size if size >= decisions.BALANCE_STANDARD_ERRORS * error else math.nan


def _fit_robustly(rows: Floats, target: Floats, use: Mask) -> tuple[Floats, Floats, float] | None:
    """Return weights, their standard errors and the explained share; None with too few rows."""
    for last in (False, True):
        if np.count_nonzero(use) < decisions.BALANCE_LEAST_ROWS:
            return None
        chosen, wanted = rows[use], target[use]
        scale = np.sqrt(np.mean(chosen**2, axis=0)) + np.finfo(float).tiny
        weights, _, rank, _ = np.linalg.lstsq(chosen / scale, wanted)
        if rank < chosen.shape[1]:
            return None
        left = np.abs(target - rows @ (weights / scale))
        if not last:
            use = use & (left <= np.quantile(left[use], 1.0 - decisions.BALANCE_TRIMMED))
    power, missing = float(np.sum(wanted**2)), float(np.sum(left[use] ** 2))
    if power == 0.0:
        return None
    spread = decisions.BALANCE_CORRELATED_SAMPLES * missing / len(wanted)
    inverse = np.linalg.pinv((chosen / scale).T @ (chosen / scale))
    errors = np.sqrt(np.maximum(np.diag(inverse), 0.0) * spread) / scale
    return weights / scale, errors, 1.0 - missing / power


def _own_gravity(case: Case) -> float:
    """Return the squared frequency of the hanging pole by the twin file, 1/s^2."""
    theta = make_theta(case.twin)
    return float(theta[MOMENT] * theta[GRAVITY] / theta[INERTIA])


def _is_near(balance: PoleBalance, case: Case, factor: float) -> bool:
    """Tell whether the frequency is known, and the twin's up to a factor."""
    own = _own_gravity(case)
    if not (balance.gravity > 0.0 and own > 0.0):
        return False
    return abs(math.log(balance.gravity / own)) <= 2.0 * math.log(factor)


def _pick_unit(ratio: float, units: Mapping[str, float]) -> str | None:
    """Return the unit that a measured ratio to the twin's speaks for, if any."""
    for name, count in units.items():
        if abs(math.log(ratio / count)) <= math.log(decisions.UNIT_FACTOR):
            return name
    return None


def _advise(option: str, more: str = "") -> str:
    return f"import the file with {option} {more}".rstrip()
