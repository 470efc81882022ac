"""Run twins freely, driven by a recorded command: three passes in order, many runs at once.

Arguments that the functions share:
theta: (sets, SIZE) or (lanes, SIZE), parameter vectors.
states: (..., 4) x (m), th (rad), v (m/s), w (rad/s).
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_twin import compose, kernel
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.compose import PATHS
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.law_curves import convert_positions
from pendulum_twin.laws.kind import Role
from pendulum_twin.motion import ALL_LAWS, HELD_LAWS, NO_LAWS, PLAIN_LAWS
from pendulum_twin.parameter_vector import (
    BASE,
    LAWS,
    SLOTS,
    find_active_effects,
    list_law_kinds,
)
from pendulum_twin.path_forces import follow_recorded_path, have_path_forces
from pendulum_twin.signals import Signals
from pendulum_twin.threads import share_among_threads

# Masks over the catalogue: effects of the mechanics, laws that act evenly over a step, costly
# laws, laws that can hold a joint.
_MECHANICAL = np.array(
    [
        e.form in (Form.FORCE, Form.DRY, Form.DRY_RATIO, Form.HOLD, *compose.HELD_FORMS)
        for e in CATALOGUE
    ]
)
_HOLDING = np.array([e.form in compose.HELD_FORMS for e in CATALOGUE])
_COSTLY = np.array([compose.is_costly(e) for e in CATALOGUE])
_STICKING = np.array(
    [e.form in (Form.DRY, Form.HOLD, Form.TIMED_FRICTION, Form.STATE_FRICTION) for e in CATALOGUE]
)
_MEASURING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form is Form.MEASURE]
_FILTERING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form in (Form.FILTER, Form.CLOCK)]
_REPORTING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form is Form.REPORT]
_CLOCKS = [e for e in CATALOGUE if e.form is Form.CLOCK]
_HELD = (Role.GAIN, Role.FORCE, Role.TORQUE, Role.CART_DRAG, Role.POLE_DRAG)
_DRY = (Role.CART_DRY, Role.POLE_DRY)
_ERRORS = (Role.ANGLE_ERROR, Role.POSITION_ERROR)
RATES = (2, 3)  # columns of the velocities in a state


def run_freely(
    signals: Signals, theta: Floats, set_of: Ints, begin: Ints, start_states: Floats, samples: int
) -> Floats:
    """Return what the sensors would have shown in runs driven by the recorded command.

    theta: (sets, SIZE) the twins.
    set_of: (runs,) the twin of each run.
    begin: (runs,) sample at which each run starts; the run must end inside the recording.
    start_states: (runs, 4) measured states there.
    samples: of a run, the start included.

    Returns (runs, samples, 4); the first sample is the start state.
    """
    drives = run_drive(signals, theta)
    return run_driven(signals, drives, theta, set_of, begin, start_states, samples)


def run_driven(
    signals: Signals,
    drives: tuple[Floats, Ints],
    theta: Floats,
    set_of: Ints,
    begin: Ints,
    start_states: Floats,
    samples: int,
) -> Floats:
    """Return what `run_freely` returns; drives: what `run_drive` returned for these twins."""
    sub = kernel.count_substeps(signals.period_s)
    rows, row_of = drives
    lane_theta = theta[set_of]
    true = np.empty((len(begin), samples, 4))
    begin = np.asarray(begin, dtype=np.int64)
    t = signals.clock_s[begin]
    run_mechanics(
        rows,
        row_of[set_of],
        begin * sub,
        np.round(t / signals.period_s).astype(np.int64) * sub,
        undo_sensors(start_states, lane_theta, t, theta),
        lane_theta,
        signals.period_s / sub,
        sub,
        true,
        theta,
        find_path_forces(signals, theta, set_of, begin),
    )
    times = t[:, None] + signals.period_s * np.arange(samples)
    shown = apply_sensors(true, lane_theta, times, theta)
    return apply_reporting(shown, lane_theta, signals.period_s, theta)


def find_path_forces(signals: Signals, theta: Floats, set_of: Ints, begin: Ints) -> Floats:
    """Return the forces on the cart (N) that follow its path, (runs, PATHS), where runs begin.

    The path is the recorded path until there; a recording begins without force.
    """
    out = np.zeros((len(begin), PATHS))
    if signals.cart is None:
        return out
    states = np.zeros((1, len(signals), 4))
    states[0, :, 0] = signals.cart
    for k in np.flatnonzero([have_path_forces(twin) for twin in theta]):
        true = undo_sensors(states, theta[[k]], signals.clock_s)
        out[set_of == k] = follow_recorded_path(signals, true[0, :, 0], theta[k])[
            begin[set_of == k]
        ]
    return out


def run_drive(signals: Signals, theta: Floats) -> tuple[Floats, Ints]:
    """Return the command after command and drive, before the gain, and the row of each twin.

    The rows have the shape (rows, samples * substeps). Twins with the same command and drive share
    a row.
    """
    sub = kernel.count_substeps(signals.period_s)
    _, first, row_of = np.unique(
        _select_filter_columns(theta), axis=0, return_index=True, return_inverse=True
    )
    rows = np.empty((len(first), len(signals) * sub))
    clock_s = signals.clock_s
    for row, chosen in zip(rows, first, strict=True):
        on = find_active_effects(theta[chosen])
        h = signals.period_s / sub * float(compute_paces(theta[chosen]))
        offsets = compute_memory_offsets(h)
        for stretch in signals.stretches:
            steps = round(clock_s[stretch.start] / signals.period_s) * sub
            out = row[stretch.start * sub : stretch.stop * sub]
            kernel.filter_command(
                signals.command[stretch],
                np.zeros(offsets[-1]),
                offsets,
                h,
                sub,
                steps,
                theta[chosen],
                on,
                out,
            )
    return rows, row_of.reshape(-1).astype(np.int64)


def _select_filter_columns(theta: Floats) -> Floats:
    """Return the columns of theta that command and drive depend on.

    A column of the base model counts only where a filter that is on takes it.
    """
    columns = []
    on = find_active_effects(theta)
    for k, e in _FILTERING:
        columns.append(theta[:, SLOTS[e.name]])
        if on[k] and e.constants:
            columns.append(theta[:, [BASE.index(name) for name in e.constants]])
    if any(kind.role is Role.COMMAND for kind in list_law_kinds(theta)):
        columns.append(theta[:, LAWS:])
    return np.concatenate(columns, axis=1)


def compute_memory_offsets(h: float) -> Ints:
    """Return where each filter's memory begins for substeps of h s, and the size of all."""
    return np.concatenate([[0], np.cumsum(compose.compute_memory_sizes(h))]).astype(np.int64)


def compute_paces(theta: Floats) -> Floats:
    """Return the time, s, that passes per second of the stamps, for theta (..., SIZE), (...)."""
    pace = np.ones(theta.shape[:-1])
    for e in _CLOCKS:
        slot = SLOTS[e.name]
        pace = pace * e.law(*(theta[..., k] for k in range(slot.start, slot.stop)))
    return pace


def run_mechanics(
    drives: Floats,
    drive_of: Ints,
    begin: Ints,
    first_step: Ints,
    start_states: Floats,
    theta: Floats,
    h: float,
    sub: int,
    out: Floats,
    sets: Floats | None = None,
    path_forces: Floats | None = None,
) -> None:
    """Call `kernel.integrate_lanes` with the least code that holds the effects of the lanes.

    Lanes are independent: several threads share the blocks of lanes where the work is worth it.

    sets: (sets, SIZE) the different twins among the lanes; None where they are not known.
    path_forces: (lanes, PATHS) N, forces on the cart that follow its path, at the start;
        afterwards at the end. None: the path begins at the start.
    """
    code = select_kernel_code(theta if sets is None else sets)
    following = np.zeros((len(theta), PATHS)) if path_forces is None else path_forces
    drives, start_states, theta = map(np.ascontiguousarray, (drives, start_states, theta))

    def integrate(part: slice) -> None:
        kernel.integrate_lanes(
            (0,) * (1 if len(theta) == 1 else kernel.WIDTH),
            *code,
            drives,
            drive_of[part],
            begin[part],
            first_step[part],
            start_states[part],
            following[part],
            theta[part],
            h,
            sub,
            out[part],
        )

    share_among_threads(integrate, len(theta), out.shape[1] * sub)


def select_kernel_code(
    theta: Floats,
) -> tuple[tuple[int, ...] | None, bool, tuple[int, ...] | None]:
    """Return laws, dry and measured of `kernel.integrate_lanes`: the least code.

    theta: (lanes, SIZE).
    """
    on = find_active_effects(theta)
    roles = {kind.role for kind in list_law_kinds(theta)}
    sticks = not roles.isdisjoint(_DRY)
    dry = bool(np.any(on & _STICKING)) or sticks
    measured = (0,) if sticks or not roles.isdisjoint(_HELD) else None
    if not np.any(on & _MECHANICAL):
        return PLAIN_LAWS if sticks else NO_LAWS, dry, measured
    if np.any(on & _MECHANICAL & _COSTLY):
        return ALL_LAWS, dry, measured
    return HELD_LAWS if np.any(on & _HOLDING) else PLAIN_LAWS, dry, measured


def apply_sensors(states: Floats, theta: Floats, t: Floats, sets: Floats | None = None) -> Floats:
    """Return what the sensors show of true states (lanes, ..., 4).

    theta: (lanes, SIZE).
    t: (lanes, ...) s by the stamps, from the start of the recording.
    sets: (sets, SIZE) the different twins among the lanes; None where they are not known.

    The velocities are by the stamps, too; `apply_reporting` makes them as reported.
    """
    sets = theta if sets is None else sets
    effects = select_measuring_effects(sets)
    if _have_errors(sets):
        states = _convert_positions(states, theta, undo=False)
    return _scale_rates(pass_through_sensors(states, theta, effects, t), theta, sets, 1.0)


def undo_sensors(states: Floats, theta: Floats, t: Floats, sets: Floats | None = None) -> Floats:
    """Return the true states behind measured ones; the inverse of `apply_sensors`."""
    sets = theta if sets is None else sets
    effects = [
        replace(e, law=e.inverse)
        for e in reversed(select_measuring_effects(sets))
        if e.inverse is not None
    ]
    rates = _scale_rates(states, theta, sets, -1.0)
    states = pass_through_sensors(rates, theta, effects, t)
    return _convert_positions(states, theta, undo=True) if _have_errors(sets) else states


def _have_errors(sets: Floats) -> bool:
    """Return whether any twin (sets, SIZE) holds a measured error of a sensor."""
    return any(kind.role in _ERRORS for kind in list_law_kinds(sets))


def _convert_positions(states: Floats, theta: Floats, undo: bool) -> Floats:
    """Return states (lanes, ..., 4) after the measured errors of the sensors, or before them."""
    flat = np.array(states, dtype=np.float64).reshape(-1, 4)
    lane_of = np.repeat(np.arange(len(theta)), len(flat) // max(len(theta), 1))
    convert_positions(flat, lane_of, np.ascontiguousarray(theta), undo)
    return flat.reshape(states.shape)


def _scale_rates(states: Floats, theta: Floats, sets: Floats, power: float) -> Floats:
    """Return states with velocities multiplied by a power of the pace of their lane."""
    if np.all(compute_paces(sets) == 1.0):
        return states
    pace = compute_paces(theta)
    states = states.copy()
    states[..., RATES] *= (pace**power).reshape(_make_lane_shape(states))
    return states


def apply_reporting(
    states: Floats, theta: Floats, period_s: float, sets: Floats | None = None
) -> Floats:
    """Return measured states (lanes, samples, 4) with the velocities as they are reported."""
    effects = select_reporting_effects(theta if sets is None else sets)
    if effects:
        states = states.copy()
        for n in range(1, states.shape[1]):
            states[:, n, RATES] = report_rates(
                states[:, n, RATES], states[:, n - 1, RATES], theta, effects, period_s
            )
    return states


def report_rates(
    rates: Floats, before: Floats, theta: Floats, effects: list[Effect], period_s: float
) -> Floats:
    """Return reported velocities (lanes, 2); before: those reported a sample earlier."""
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
    states: Floats, theta: Floats, effects: list[Effect], t: Floats
) -> Floats:
    """Return states after these sensor effects; see `apply_sensors`."""
    if not effects:
        return states.copy()
    x, th, v, w = (states[..., k] for k in range(4))
    for effect in effects:
        slot = SLOTS[effect.name]
        columns = (theta[:, k].reshape(_make_lane_shape(x)) for k in range(slot.start, slot.stop))
        with np.errstate(over="ignore", invalid="ignore"):  # a run that ran away shows no number
            x, v, th, w = effect.law(x, v, th, w, t, *columns)
    return np.stack([x, th, v, w], axis=-1)


def _make_lane_shape(values: Floats) -> tuple[int, ...]:
    """Return the shape in which numbers (lanes,) go with values (lanes, ...)."""
    return (-1,) + (1,) * (values.ndim - 1)
