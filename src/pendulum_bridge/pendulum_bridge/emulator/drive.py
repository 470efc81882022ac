"""From the command to the force: the emulator's command and drive effects, a closure a stage.

Each step of the engine calls every stage once, in the order of STAGES; a stage takes a command
(PWM fraction) and returns the command that it makes of it. step_s is the engine's step.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping

LEAST_GAIN, MOST_GAIN = 0.1, 10.0  # of the first: where a drive ends that fades, or grows
MOTOR_SHARE = 0.1  # of the moved mass: the motor's own mass, seen at the belt

Stage = Callable[[float], float]
Effects = Mapping[str, Mapping[str, float]]


def make_inversion(step_s: float) -> Stage:
    """Return a stage that turns the command's sign."""
    return lambda u: -u


def make_delay(step_s: float, delay_s: float) -> Stage:
    """Return a stage that gives the command of delay_s ago, 0 before the first.

    A delay between two steps mixes both steps' commands in proportion.
    """
    steps, fraction = divmod(delay_s / step_s, 1.0)
    past = deque([0.0] * (int(steps) + 2), maxlen=int(steps) + 2)

    def stage(u: float) -> float:
        past.append(u)
        return past[1] + fraction * (past[0] - past[1])

    return stage


def make_dead_zone(step_s: float, width: float) -> Stage:
    """Return a stage that gives 0 within +-width and makes larger commands smaller by width."""
    return lambda u: math.copysign(max(abs(u) - width, 0.0), u)


def make_saturation(step_s: float, limit: float) -> Stage:
    """Return a stage that clips the command at +-limit."""
    return lambda u: math.copysign(min(abs(u), limit), u)


def make_bend(step_s: float, limit: float) -> Stage:
    """Return a stage that bends the command towards +-limit."""

    def stage(u: float) -> float:
        grown = math.exp(-2 * abs(u) / limit)
        return math.copysign(limit * (1 - grown) / (1 + grown), u)

    return stage


def make_counter(step_s: float, step: float) -> Stage:
    """Return a stage that counts whole steps of the command, and half a step as a whole step."""

    def stage(u: float) -> float:
        whole, rest = divmod(abs(u), step)
        return math.copysign(step * (whole + (rest >= 0.5 * step)), u)

    return stage if step else lambda u: u


def make_asymmetry(step_s: float, ratio: float) -> Stage:
    """Return a stage that makes positive commands stronger by ratio, negative weaker."""
    return lambda u: u + ratio * abs(u)


def make_drift(step_s: float, per_s: float) -> Stage:
    """Return a stage whose gain changes by per_s of its first value every second.

    A rig that runs for long ends at LEAST_GAIN or MOST_GAIN of it.
    """
    steps = 0

    def stage(u: float) -> float:
        nonlocal steps
        steps += 1
        gain = 1.0 + per_s * (steps - 0.5) * step_s
        if LEAST_GAIN < gain < MOST_GAIN:
            return u + u * per_s * (steps - 0.5) * step_s
        return u * min(max(gain, LEAST_GAIN), MOST_GAIN)

    return stage


def make_ramp(step_s: float, ramp_s: float) -> Stage:
    """Return a stage that moves to a command of 1 in ramp_s at the fastest; it begins at 0.

    It gives its mean over the step: it moves for a part of the step, and then stays.
    """
    output = 0.0

    def stage(u: float) -> float:
        nonlocal output
        needed_s = ramp_s * abs(u - output)
        moving_s = min(needed_s, step_s)
        before = output
        output = u if needed_s <= step_s else output + math.copysign(step_s / ramp_s, u - output)
        return output - 0.5 * (output - before) * moving_s / step_s

    return stage


def make_lag(step_s: float, time_constant_s: float) -> Stage:
    """Return a stage with a first-order lag; it gives the value in the middle of the step."""
    output, over_half = 0.0, math.exp(-0.5 * step_s / time_constant_s)

    def stage(u: float) -> float:
        nonlocal output
        middle = u + (output - u) * over_half
        output = u + (middle - u) * over_half
        return middle

    return stage


def make_slack(step_s: float, gap_m: float, per_command_m_s2: float) -> Stage:
    """Return a stage that gives 0 while the motor crosses the belt's slack.

    There the motor is a free mass that the command drives. It begins at the end from which it
    pulls the negative way, stops dead where the belt is tight, and pulls from then on.
    gap_m: width of the slack.
    per_command_m_s2: acceleration of all that moves, a unit of command; the motor alone is lighter
        (MOTOR_SHARE).
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


def make_offset(step_s: float, offset: float) -> Stage:
    """Return a stage that adds an offset to every command."""
    return lambda u: u + offset


def _compute_crossing_time(way: float, speed: float, acceleration: float, step_s: float) -> float:
    """Return when a mass has gone `way` (m), at most step_s.

    The first root of way = speed t + acceleration t^2 / 2.
    """
    root = math.sqrt(max(speed**2 + 2 * acceleration * way, 0.0))
    return min(max(2 * way / (speed + math.copysign(root, way)), 0.0), step_s) if way else 0.0


STAGES: dict[str, Callable[..., Stage]] = {
    "input_sign_inverted": make_inversion,
    "input_delay": make_delay,
    "coarse_command": make_counter,
    "input_dead_zone": make_dead_zone,
    "input_saturation": make_saturation,
    "soft_saturation": make_bend,
    "gain_asymmetry": make_asymmetry,
    "gain_drift": make_drift,
    "drive_slew_limit": make_ramp,
    "motor_lag": make_lag,
    "belt_backlash": make_slack,
    "drive_offset": make_offset,
}


def make_drive(effects: Effects, step_s: float, per_command_m_s2: float = 1.0) -> Stage:
    """Return the stages of the effects as one stage that remembers nothing yet.

    per_command_m_s2: see `make_slack`.
    """
    stages = []
    for name, make in STAGES.items():
        if name in effects:
            more = {"per_command_m_s2": per_command_m_s2} if make is make_slack else {}
            stages.append(make(step_s, **effects[name], **more))

    def stage(u: float) -> float:
        for apply_effect in stages:
            u = apply_effect(u)
        return u

    return stage
