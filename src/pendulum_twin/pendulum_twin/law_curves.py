"""Evaluate the measured laws of a parameter vector, one lane at a time.

A law reads its slot of theta and the state; no code is written for a kind of its own. Arguments:
theta: (SIZE,) of one lane.
at: where a law's slot begins in theta.
x, v, th, w: true state; m, m/s, rad, rad/s. u: command. t: s since the recording began.
"""

from __future__ import annotations

import math

import numpy as np

from pendulum_twin.equations import compile_inner
from pendulum_twin.laws import KINDS
from pendulum_twin.laws.kind import Role, Variable
from pendulum_twin.machine_code import compile_cached
from pendulum_twin.parameter_vector import (
    FIRST,
    INERTIA,
    KIND,
    KNOTS,
    LAW_SIZE,
    LAWS,
    MASS,
    SIZE,
    SPACING,
    VALUES,
)

ROLES = np.array([-1, *(int(kind.role) for kind in KINDS)])  # by the number in a law's slot
OVER = np.array([-1, *(int(kind.variable) for kind in KINDS)])
# Plain integers: the compiler takes them as constants.
COMMAND, GAIN, FORCE, CART_DRAG, CART_DRY = (int(role) for role in list(Role)[:5])
TORQUE, POLE_DRAG, POLE_DRY, CART_ONE_WAY, POLE_ONE_WAY = (int(role) for role in list(Role)[5:10])
CART_HYSTERESIS, ANGLE_ERROR = int(Role.CART_HYSTERESIS), int(Role.ANGLE_ERROR)
POSITION_ERROR, PACE = int(Role.POSITION_ERROR), int(Role.PACE)
POSITION, VELOCITY, ANGLE, RATE, TIME = (int(variable) for variable in list(Variable)[1:6])
SHAFT = int(Variable.SHAFT)
NO_LAWS_HELD = (1.0, 0.0, 0.0, 0.0, 0.0)
FASTEST_CART, FASTEST_POLE = 3.0, 40.0  # m/s, rad/s; see `_drag`
INVERSIONS = 30  # steps at most: plain steps undo an error of slope 0.5 to 1e-9 of itself
STEEPEST = -0.5  # slope of an error down to which Newton's method undoes it
CLOSE = 1e-7  # m, rad; a step of Newton's method after which its error is below a bit


@compile_inner
def _follow_curve(theta, at, where, periodic):
    """Return a curve's value and slope at a place of its variable.

    A cubic through the knots (`laws.law.make_curve_matrix` has the same weights); constant beyond
    the outermost knots, unless it is periodic. A place that is no number counts as the first knot.
    """
    count = int(theta[at + KNOTS])
    z = (where - theta[at + FIRST]) / theta[at + SPACING]
    inside = True
    if periodic:
        z -= count * math.floor(z / count)
        if not (z >= 0.0 and z < count):
            z = 0.0
        left = int(z)
    else:
        if not z > 0.0:
            z, inside = 0.0, False
        if z >= count - 1.0:
            z, inside = count - 1.0, False
        left = min(int(z), count - 2)
    f = z - left
    values = at + VALUES
    if periodic:
        a = theta[values + (left - 1 if left > 0 else count - 1)]
        b = theta[values + left]
        c = theta[values + (left + 1 if left + 1 < count else 0)]
        d = theta[values + (left + 2 if left + 2 < count else left + 2 - count)]
    else:
        b, c = theta[values + left], theta[values + left + 1]
        a = theta[values + left - 1] if left > 0 else 2.0 * b - c
        d = theta[values + left + 2] if left + 2 < count else 2.0 * c - b
    first, second = 0.5 * (c - a), 0.5 * (d - b)
    bend, twist = 3.0 * (c - b) - 2.0 * first - second, 2.0 * (b - c) + first + second
    value = b + f * (first + f * (bend + f * twist))
    slope = (first + f * (2.0 * bend + 3.0 * f * twist)) / theta[at + SPACING]
    return value, slope if inside else 0.0


@compile_inner
def _follow_law(theta, at, over, u, x, v, th, w, t):
    """Return a law's value at a state."""
    where = u
    if over in (POSITION, SHAFT):
        where = x
    elif over == VELOCITY:
        where = v
    elif over == ANGLE:
        where = th
    elif over == RATE:
        where = w
    elif over == TIME:
        where = t
    return _follow_curve(theta, at, where, over in (ANGLE, SHAFT))[0]


@compile_inner
def _drag(coefficient, speed, over, fastest):
    """Return the force (torque) of a drag, which holds back or, below 0, drives.

    over: a step over the mass (inertia): a strong drag stops a joint within a step and no more.
    fastest: speed up to which a drag below 0 drives the more the faster: no run escapes.
    """
    if coefficient < 0.0:
        return -coefficient * min(max(speed, -fastest), fastest)
    return -coefficient * speed / (1.0 + 0.5 * coefficient * over)


@compile_inner
def sum_measured_laws(theta, x, v, th, w, t, h):
    """Return what the laws of drive, cart and pole do over a step of h s.

    Gain on the drive's force; force on the cart, N; torque on the pole, N m; what is added to the
    dry friction of the cart, N, and of the pole, N m.
    """
    gain, force, torque, cart_dry, pole_dry = NO_LAWS_HELD
    for at in range(LAWS, SIZE, LAW_SIZE):
        number = int(theta[at + KIND])
        if number == 0:
            continue
        role = ROLES[number]
        if role == COMMAND or role >= CART_HYSTERESIS:  # see `hysteresis`; sensors and clock below
            continue
        value = _follow_law(theta, at, OVER[number], 0.0, x, v, th, w, t)
        if role == GAIN:
            gain *= 1.0 + value
        elif role == FORCE:
            force += value
        elif role == CART_DRAG:
            force += _drag(value, v, h / theta[MASS], FASTEST_CART)
        elif role == CART_DRY:
            cart_dry += value
        elif role == TORQUE:
            torque += value
        elif role == POLE_DRAG:
            torque += _drag(value, w, h / theta[INERTIA], FASTEST_POLE)
        elif role == POLE_DRY:
            pole_dry += value
        elif role == CART_ONE_WAY:
            force += value * min(abs(v), FASTEST_CART)
        else:
            torque += value * min(abs(w), FASTEST_POLE)
    return gain, force, torque, cart_dry, pole_dry


@compile_inner
def bend_command(theta, u):
    """Return the command after the measured laws of the command."""
    for at in range(LAWS, SIZE, LAW_SIZE):
        number = int(theta[at + KIND])
        if number > 0 and ROLES[number] == COMMAND:
            u += _follow_curve(theta, at, u, False)[0]
    return u


@compile_inner
def bend_commands(theta, out):
    """Pass commands (n,) through the measured laws of the command, in place."""
    bends = False
    for at in range(LAWS, SIZE, LAW_SIZE):
        bends = bends or ROLES[int(theta[at + KIND])] == COMMAND
    if bends:
        for k in range(len(out)):
            out[k] = bend_command(theta, out[k])


@compile_inner
def show_positions(theta, x, v, th, w):
    """Return the state as its sensors' measured errors show it: x, v, th, w."""
    for at in range(LAWS, SIZE, LAW_SIZE):
        number = int(theta[at + KIND])
        if number > 0 and ROLES[number] == ANGLE_ERROR:
            error, slope = _follow_curve(theta, at, th, True)
            th, w = th + error, w * (1.0 + slope)
        elif number > 0 and ROLES[number] == POSITION_ERROR:
            error, slope = _follow_curve(theta, at, x, OVER[number] == SHAFT)
            x, v = x + error, v * (1.0 + slope)
    return x, v, th, w


@compile_inner
def has_curves(theta):
    """Return whether a measured law of drive, cart or pole is a curve."""
    curves = False
    for at in range(LAWS, SIZE, LAW_SIZE):
        role = ROLES[int(theta[at + KIND])]
        curves = curves or COMMAND < role < CART_HYSTERESIS
    return curves


@compile_inner
def has_pace(theta):
    """Return whether a measured law changes the pace of the clock."""
    wanders = False
    for at in range(LAWS, SIZE, LAW_SIZE):
        wanders = wanders or ROLES[int(theta[at + KIND])] == PACE
    return wanders


@compile_inner
def follow_pace(theta, t):
    """Return the factor by which the clock's measured laws change its pace at t s."""
    pace = 1.0
    for at in range(LAWS, SIZE, LAW_SIZE):
        if ROLES[int(theta[at + KIND])] == PACE:
            pace *= 1.0 + _follow_curve(theta, at, t, False)[0]
    return pace


@compile_inner
def _undo_error(theta, at, shown, periodic):
    """Return the place of which a law's error makes the shown place, and the error's slope there.

    Steps of Newton's method; plain steps at its end, so that the place shows the very bits, and
    where the error falls steeply.
    """
    place, slope, far = shown, 0.0, True
    for _ in range(INVERSIONS):
        before = place
        error, slope = _follow_curve(theta, at, place, periodic)
        if far and slope > STEEPEST:
            place += (shown - error - place) / (1.0 + slope)
            far = abs(place - before) > CLOSE
        else:
            place = shown - error
            if place == before:
                break
    return place, slope


@compile_inner
def _find_positions(theta, x, v, th, w):
    """Return the state behind measured errors; the inverse of `show_positions`."""
    for at in range(LAWS, SIZE, LAW_SIZE):
        number = int(theta[at + KIND])
        if number > 0 and ROLES[number] == ANGLE_ERROR:
            th, slope = _undo_error(theta, at, th, True)
            w = w / max(1.0 + slope, 0.1)
        elif number > 0 and ROLES[number] == POSITION_ERROR:
            x, slope = _undo_error(theta, at, x, OVER[number] == SHAFT)
            v = v / max(1.0 + slope, 0.1)
    return x, v, th, w


@compile_cached
def fill_measured_laws(states, t, theta, out):
    """Fill out (n, 5) with `sum_measured_laws` at states (n, 4) x, th, v, w and times (n,)."""
    for n in range(len(states)):
        x, th, v, w = states[n, 0], states[n, 1], states[n, 2], states[n, 3]
        gain, force, torque, cart_dry, pole_dry = sum_measured_laws(theta, x, v, th, w, t[n], 0.0)
        out[n, 0], out[n, 1], out[n, 2] = gain, force, torque
        out[n, 3], out[n, 4] = cart_dry, pole_dry


@compile_cached
def multiply_paces(t, row_of, theta, out):
    """Multiply paces out (n,) by the clock's measured laws, in place.

    t: (n,) s. row_of, theta: see `convert_positions`.
    """
    for n in range(len(t)):
        out[n] *= follow_pace(theta[row_of[n]], t[n])


@compile_cached
def convert_positions(states, row_of, theta, undo):
    """Pass states (n, 4) x, th, v, w through the sensors' measured errors, in place.

    row_of: (n,) row of theta of each state.
    theta: (sets, SIZE).
    undo: whether the errors are taken away instead.
    """
    row, p = 0, theta[0]
    for n in range(len(states)):
        if row_of[n] != row:
            row, p = row_of[n], theta[row_of[n]]
        x, th, v, w = states[n, 0], states[n, 1], states[n, 2], states[n, 3]
        if undo:
            x, v, th, w = _find_positions(p, x, v, th, w)
        else:
            x, v, th, w = show_positions(p, x, v, th, w)
        states[n, 0], states[n, 1], states[n, 2], states[n, 3] = x, th, v, w


@compile_cached
def bend_command_from_python(theta, u):
    """Call `bend_command` from Python."""
    return bend_command(theta, u)


@compile_cached
def find_command(theta, wanted):
    """Return the command that the measured laws of the command make the wanted command of."""
    u = wanted
    for _ in range(INVERSIONS):
        u += 0.7 * (wanted - bend_command(theta, u))
    return u
