"""What the sensors show of true states, and which true states are behind what they show.

The clock of the stamps counts as a sensor, too: velocities are by the stamps.

Arguments that the functions share:
theta: (sets, SIZE), parameter vectors.
set_of: (lanes,) row of theta of each lane; None where each lane has a row of its own.
states: (..., 4) x (m), th (rad), v (m/s), w (rad/s).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.law_curves import convert_positions, multiply_paces
from pendulum_twin.laws.kind import SENSOR_ERRORS, Role
from pendulum_twin.parameter_vector import SLOTS, find_active_effects, list_law_kinds

_MEASURING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form is Form.MEASURE]
_REPORTING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form is Form.REPORT]
_CLOCKS = [e for e in CATALOGUE if e.form is Form.CLOCK]
RATES = (2, 3)  # columns of the velocities in a state


def apply_sensors(states: Floats, theta: Floats, t: Floats, set_of: Ints | None = None) -> Floats:
    """Return what the sensors show of true states (lanes, ..., 4).

    t: (lanes, ...) s by the stamps, from the start of the recording.

    The velocities are by the stamps, too; `apply_reporting` makes them as reported.
    """
    effects = select_measuring_effects(theta)
    if _have_errors(theta):
        states = _convert_positions(states, theta, set_of, undo=False)
    shown = pass_through_sensors(states, theta, effects, t, set_of)
    return _scale_rates(shown, theta, t, set_of, 1.0)


def undo_sensors(states: Floats, theta: Floats, t: Floats, set_of: Ints | None = None) -> Floats:
    """Return the true states behind measured ones; the inverse of `apply_sensors`."""
    effects = [
        replace(e, law=e.inverse)
        for e in reversed(select_measuring_effects(theta))
        if e.inverse is not None
    ]
    rates = _scale_rates(states, theta, t, set_of, -1.0)
    states = pass_through_sensors(rates, theta, effects, t, set_of)
    return _convert_positions(states, theta, set_of, undo=True) if _have_errors(theta) else states


def apply_reporting(
    states: Floats, theta: Floats, period_s: float, set_of: Ints | None = None
) -> Floats:
    """Return measured states (lanes, samples, 4) with the velocities as they are reported."""
    effects = select_reporting_effects(theta)
    if effects:
        theta = theta if set_of is None else theta[set_of]
        states = states.copy()
        for n in range(1, states.shape[1]):
            states[:, n, RATES] = report_rates(
                states[:, n, RATES], states[:, n - 1, RATES], theta, effects, period_s
            )
    return states


def report_rates(
    rates: Floats, before: Floats, theta: Floats, effects: list[Effect], period_s: float
) -> Floats:
    """Return reported velocities (lanes, 2).

    before: those reported a sample earlier.
    theta: (lanes, SIZE).
    """
    for e in effects:
        slot = SLOTS[e.name]
        for i in range(len(rates)):
            rates[i] = e.law(rates[i], before[i], period_s, *theta[i, slot])
    return rates


def select_reporting_effects(theta: Floats) -> list[Effect]:
    """Return the effects on reported velocities that are on in any lane."""
    on = find_active_effects(theta)
    return [e for k, e in _REPORTING if on[k]]


def select_measuring_effects(theta: Floats) -> list[Effect]:
    """Return the sensor's effects that are on in any lane, in chain order."""
    on = find_active_effects(theta)
    return [e for k, e in _MEASURING if on[k]]


def pass_through_sensors(
    states: Floats, theta: Floats, effects: list[Effect], t: Floats, set_of: Ints | None = None
) -> Floats:
    """Return states after these sensor effects; see `apply_sensors`."""
    if not effects:
        return states.copy()
    x, th, v, w = (states[..., k] for k in range(4))
    for effect in effects:
        slot = SLOTS[effect.name]
        columns = (
            _deal(theta[:, k], set_of).reshape(_make_lane_shape(x))
            for k in range(slot.start, slot.stop)
        )
        with np.errstate(over="ignore", invalid="ignore"):  # a run that ran away shows no number
            x, v, th, w = effect.law(x, v, th, w, t, *columns)
    return np.stack([x, th, v, w], axis=-1)


def compute_paces(theta: Floats) -> Floats:
    """Return the time, s, that passes per second of the stamps, for theta (..., SIZE), (...).

    Without the clock's measured law; `follow_paces` has it.
    """
    pace = np.ones(theta.shape[:-1])
    for e in _CLOCKS:
        slot = SLOTS[e.name]
        pace = pace * e.law(*(theta[..., k] for k in range(slot.start, slot.stop)))
    return pace


def follow_paces(theta: Floats, t: Floats, set_of: Ints | None = None) -> Floats:
    """Return the time, s, that passes per second of the stamps, (lanes, ...).

    t: (lanes, ...) s by the stamps, from the start of the recording.
    """
    own = _deal(compute_paces(theta), set_of).reshape(_make_lane_shape(t))
    even = np.broadcast_to(own, t.shape)
    paces = even.reshape(-1).copy()
    times = np.ascontiguousarray((t * even).reshape(-1))
    rows = _list_rows(t.shape[0], len(paces), set_of)
    multiply_paces(times, rows, np.ascontiguousarray(theta), paces)
    return paces.reshape(t.shape)


def _deal(values: Floats, set_of: Ints | None) -> Floats:
    """Return a value of each set, (sets,), for every lane, (lanes,)."""
    return values if set_of is None else values[set_of]


def _list_rows(lanes: int, count: int, set_of: Ints | None) -> Ints:
    """Return the row of theta of each of `count` values, as many of each lane."""
    return np.repeat(np.arange(lanes) if set_of is None else set_of, count // max(lanes, 1))


def _have_errors(theta: Floats) -> bool:
    """Return whether any twin holds a measured error of a sensor."""
    return any(kind.role in SENSOR_ERRORS for kind in list_law_kinds(theta))


def _convert_positions(states: Floats, theta: Floats, set_of: Ints | None, undo: bool) -> Floats:
    """Return states (lanes, ..., 4) after the measured errors of the sensors, or before them."""
    flat = np.array(states, dtype=np.float64).reshape(-1, 4)
    rows = _list_rows(len(states), len(flat), set_of)
    convert_positions(flat, rows, np.ascontiguousarray(theta), undo)
    return flat.reshape(states.shape)


def _scale_rates(
    states: Floats, theta: Floats, t: Floats, set_of: Ints | None, power: float
) -> Floats:
    """Return states with velocities multiplied by a power of the pace of their lane."""
    varies = any(kind.role is Role.PACE for kind in list_law_kinds(theta))
    own = compute_paces(theta)
    if not varies and np.all(own == 1.0):
        return states
    states = states.copy()
    if varies:
        paces = follow_paces(theta, np.broadcast_to(t, states.shape[:-1]), set_of)[..., None]
    else:
        paces = _deal(own, set_of).reshape(_make_lane_shape(states))
    states[..., RATES] *= paces**power
    return states


def _make_lane_shape(values: Floats) -> tuple[int, ...]:
    """Return the shape in which numbers (lanes,) go with values (lanes, ...)."""
    return (-1,) + (1,) * (values.ndim - 1)
