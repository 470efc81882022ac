"""From the command to the force: the emulator's own command and drive effects, one closure a stage.

Every stage is called once a step of the engine, in the order of STAGES, and returns what it makes
of the command.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping

MOTOR_SHARE = 0.1  # of the moved mass: the motor's own, as the belt feels it

Stage = Callable[[float], float]
Effects = Mapping[str, Mapping[str, float]]


def make_inversion(step_s: float) -> Stage:
    """Turn the command's sign."""
    return lambda u: -u


def make_delay(step_s: float, delay_s: float) -> Stage:
    """Give the command of delay_s ago; before the first there was none. Parts of a step are shared by weight."""
    whole, part = divmod(delay_s / step_s, 1.0)
    past = deque([0.0] * (int(whole) + 2), maxlen=int(whole) + 2)

    def stage(u: float) -> float:
        past.append(u)
        return past[1] + part * (past[0] - past[1])

    return stage


def make_dead_zone(step_s: float, width: float) -> Stage:
    """Give 0 within +-width, and take width away from larger commands."""
    return lambda u: math.copysign(max(abs(u) - width, 0.0), u)


def make_saturation(step_s: float, limit: float) -> Stage:
    """Clip the command at +-limit."""
    return lambda u: math.copysign(min(abs(u), limit), u)


def make_asymmetry(step_s: float, ratio: float) -> Stage:
    """Make positive commands stronger by ratio and negative ones weaker."""
    return lambda u: u + ratio * abs(u)


def make_drift(step_s: float, per_s: float) -> Stage:
    """Change the gain by per_s of its first value every second."""
    steps = 0

    def stage(u: float) -> float:
        nonlocal steps
        steps += 1
        return u + u * per_s * (steps - 0.5) * step_s

    return stage


def make_lag(step_s: float, time_constant_s: float) -> Stage:
    """Follow the command with a first-order lag; gives its value in the middle of the step."""
    output, over_half = 0.0, math.exp(-0.5 * step_s / time_constant_s)

    def stage(u: float) -> float:
        nonlocal output
        middle = u + (output - u) * over_half
        output = u + (middle - u) * over_half
        return middle

    return stage


def make_slack(step_s: float, gap_m: float, per_command_m_s2: float) -> Stage:
    """Give nothing while the motor is within the belt's slack, which it crosses as a free mass that the command drives.

    per_command_m_s2: acceleration of everything that moves, a unit of command; the motor alone is
    lighter (MOTOR_SHARE). It begins at the end from which it pulls the negative way, stops dead
    where the belt is tight, and pulls from then on.
    """
    lightness = per_command_m_s2 / MOTOR_SHARE
    place, speed = 0.0, 0.0

    def stage(u: float) -> float:
        nonlocal place, speed
        tight = place >= gap_m if u > 0 else place <= 0 if u < 0 else speed == 0
        if tight:
            speed = 0.0
            return u
        after = place + step_s * (speed + 0.5 * step_s * lightness * u)
        if 0 < after < gap_m:
            place, speed = after, speed + step_s * lightness * u
            return 0.0
        end = gap_m if after >= gap_m else 0.0
        needed = _compute_crossing_time(end - place, speed, lightness * u, step_s)
        place, speed = end, 0.0
        return u * (1 - needed / step_s) if (u > 0) == (end > 0) else 0.0

    return stage


def _compute_crossing_time(way: float, speed: float, acceleration: float, step_s: float) -> float:
    """Return when a mass has gone that way, at most a step: the first root of way = speed t + acceleration t^2/2."""
    root = math.sqrt(max(speed**2 + 2 * acceleration * way, 0.0))
    return min(max(2 * way / (speed + math.copysign(root, way)), 0.0), step_s) if way else 0.0


STAGES: dict[str, Callable[..., Stage]] = {
    "input_sign_inverted": make_inversion,
    "input_delay": make_delay,
    "input_dead_zone": make_dead_zone,
    "input_saturation": make_saturation,
    "gain_asymmetry": make_asymmetry,
    "gain_drift": make_drift,
    "motor_lag": make_lag,
    "belt_backlash": make_slack,
}


def make_drive(effects: Effects, step_s: float, per_command_m_s2: float = 1.0) -> Stage:
    """Return all stages that the effects ask for as one, with nothing remembered yet; per_command_m_s2: see `make_slack`."""
    stages = []
    for name, make in STAGES.items():
        if name in effects:
            more = {"per_command_m_s2": per_command_m_s2} if make is make_slack else {}
            stages.append(make(step_s, **effects[name], **more))

    def stage(u: float) -> float:
        for each in stages:
            u = each(u)
        return u

    return stage
