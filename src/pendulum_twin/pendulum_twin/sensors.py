"""What the sensors show of true states, and which true states are behind what they show.

The clock of the stamps counts as a sensor, too: velocities are by the stamps.

Arguments that the functions share:
theta: (sets, SIZE), parameter vectors.
set_of: (lanes,) row of theta of each lane; None where each lane has a row of its own.
states: (..., 4) x (m), th (rad), v (m/s), w (rad/s).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pendulum_twin import compose
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.law_curves import convert_positions, multiply_paces
from pendulum_twin.laws.kind import SENSOR_ERRORS, Role
from pendulum_twin.machine_code import compile_cached
from pendulum_twin.parameter_vector import (
    NEUTRAL,
    SLOTS,
    find_active_effects,
    list_law_kinds,
)

_MEASURING: Mask = np.array([e.form in (Form.MEASURE, Form.LATE, Form.LAGGING) for e in CATALOGUE])
_REPORTING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form is Form.REPORT]
_CLOCKS = [e for e in CATALOGUE if e.form is Form.CLOCK]
RATES = (2, 3)  # columns of the velocities in a state

_measure = compose.compose_sensors()
_undo = compose.compose_sensors(undo=True)


@compile_cached
def _convert_states(states, t, row_of, theta, active, undo):  # type: ignore[no-untyped-def]
    """Pass states (n, 4) x, th, v, w through the sensors' effects that are on, in place.

    t: (n,) s by the stamps; row_of: (n,) row of theta of each state.
    undo: whether the effects are taken away instead.
    """
    row, p = 0, theta[0]
    for n in range(len(states)):
        if row_of[n] != row:  # a row is taken once: taking it costs as much as all else here
            row, p = row_of[n], theta[row_of[n]]
        x, th, v, w = states[n, 0], states[n, 1], states[n, 2], states[n, 3]
        if undo:
            x, v, th, w = _undo(x, v, th, w, t[n], p, active)
        else:
            x, v, th, w = _measure(x, v, th, w, t[n], p, active)
        states[n, 0], states[n, 1], states[n, 2], states[n, 3] = x, th, v, w


def compile_sensors() -> None:
    """Compile what states pass through where a sensor's effect is on."""
    row = np.zeros(1, dtype=np.int64)
    _convert_states(np.zeros((1, 4)), np.zeros(1), row, NEUTRAL[None].copy(), _MEASURING, False)


class Sensing(NamedTuple):
    """Hold what the sensors of twins do at all.

    errors: whether any twin holds a measured error of a sensor.
    active: (effects,) which effects of sensors are on in any twin; None: not one.
    varies: whether any clock has a measured pace.
    paces: (sets,) true time per second of the stamps; None: 1 everywhere.
    """

    errors: bool
    active: Mask | None
    varies: bool
    paces: Floats | None


def select_sensing(theta: Floats) -> Sensing:
    """Return what the sensors of twins do at all, for who asks `apply_sensors` often."""
    kinds = list_law_kinds(theta)
    active = find_active_effects(theta) & _MEASURING
    paces = compute_paces(theta)
    return Sensing(
        errors=any(kind.role in SENSOR_ERRORS for kind in kinds),
        active=active if np.any(active) else None,
        varies=any(kind.role is Role.PACE for kind in kinds),
        paces=paces if np.any(paces != 1.0) else None,
    )


def apply_sensors(
    states: Floats,
    theta: Floats,
    t: Floats,
    set_of: Ints | None = None,
    sensing: Sensing | None = None,
) -> Floats:
    """Return what the sensors show of true states (lanes, ..., 4), a copy.

    t: (lanes, ...) s by the stamps, from the start of the recording.
    sensing: of theta; None: asked for here.

    The velocities are by the stamps, too; `apply_reporting` makes them as reported.
    """
    sensing = select_sensing(theta) if sensing is None else sensing
    if sensing.errors:
        states = _convert_positions(states, theta, set_of, undo=False)
    shown = _pass_through_effects(states, theta, t, set_of, sensing, undo=False)
    return _scale_rates(shown, theta, t, set_of, sensing, 1.0)


def undo_sensors(states: Floats, theta: Floats, t: Floats, set_of: Ints | None = None) -> Floats:
    """Return the true states behind measured ones; the inverse of `apply_sensors`."""
    sensing = select_sensing(theta)
    rates = _scale_rates(states, theta, t, set_of, sensing, -1.0)
    states = _pass_through_effects(rates, theta, t, set_of, sensing, undo=True)
    return _convert_positions(states, theta, set_of, undo=True) if sensing.errors else states


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


def _pass_through_effects(
    states: Floats, theta: Floats, t: Floats, set_of: Ints | None, sensing: Sensing, undo: bool
) -> Floats:
    """Return states (lanes, ..., 4) after the sensors' effects, or before them, a copy."""
    flat = np.array(states, dtype=np.float64).reshape(-1, 4)
    if sensing.active is not None:
        times = np.ascontiguousarray(np.broadcast_to(t, states.shape[:-1])).reshape(-1)
        rows = _list_rows(len(states), len(flat), set_of)
        _convert_states(flat, times, rows, np.ascontiguousarray(theta), sensing.active, undo)
    return flat.reshape(states.shape)


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


def _convert_positions(states: Floats, theta: Floats, set_of: Ints | None, undo: bool) -> Floats:
    """Return states (lanes, ..., 4) after the measured errors of the sensors, or before them."""
    flat = np.array(states, dtype=np.float64).reshape(-1, 4)
    rows = _list_rows(len(states), len(flat), set_of)
    convert_positions(flat, rows, np.ascontiguousarray(theta), undo)
    return flat.reshape(states.shape)


def _scale_rates(
    states: Floats, theta: Floats, t: Floats, set_of: Ints | None, sensing: Sensing, power: float
) -> Floats:
    """Return states with velocities multiplied by a power of the pace of their lane."""
    if sensing.varies:
        paces = follow_paces(theta, np.broadcast_to(t, states.shape[:-1]), set_of)[..., None]
    elif sensing.paces is not None:
        paces = _deal(sensing.paces, set_of).reshape(_make_lane_shape(states))
    else:
        return states
    states = states.copy()
    states[..., RATES] *= paces**power
    return states


def _make_lane_shape(values: Floats) -> tuple[int, ...]:
    """Return the shape in which numbers (lanes,) go with values (lanes, ...)."""
    return (-1,) + (1,) * (values.ndim - 1)
