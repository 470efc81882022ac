"""Run twins freely, driven by a recorded command: three passes in order, many runs at once.

Arguments that the functions share:
theta: (sets, SIZE) or (lanes, SIZE), parameter vectors.
states: (..., 4) x (m), th (rad), v (m/s), w (rad/s).
"""

from __future__ import annotations

import numpy as np

from pendulum_twin import compose, kernel
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.compose import KEPT, PATHS
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.equal_rows import group_equal_rows
from pendulum_twin.laws.kind import REMEMBERING, SENSOR_ERRORS, Role
from pendulum_twin.motion import (
    ALL_LAWS,
    CURVES,
    HELD_LAWS,
    HYSTERESIS,
    NO_LAWS,
    PLAIN_LAWS,
    REACTING_LAWS,
)
from pendulum_twin.parameter_vector import (
    BASE,
    LAWS,
    SLOTS,
    find_active_effects,
    list_law_kinds,
)
from pendulum_twin.path_memory import (
    follow_recorded_path,
    remembers_path,
    select_path_columns,
)
from pendulum_twin.reactions import (
    REACTING,
    find_reacting_twins,
    react_to_recorded_path,
    select_reaction_columns,
)
from pendulum_twin.sensors import apply_reporting, apply_sensors, compute_paces, undo_sensors
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
_FILTERING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form in (Form.FILTER, Form.CLOCK)]
_DRY = (Role.CART_DRY, Role.POLE_DRY)
_ELSEWHERE = (Role.COMMAND, *SENSOR_ERRORS)  # act in the passes of the drive and the sensors
_HELD = tuple(r for r in Role if r not in (*_DRY, *REMEMBERING, *_ELSEWHERE))


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
    runs = run_driven(signals, drives, theta, set_of, begin, start_states, samples)
    return apply_reporting(runs, theta, signals.period_s, set_of)


def run_driven(
    signals: Signals,
    drives: tuple[Floats, Ints],
    theta: Floats,
    set_of: Ints,
    begin: Ints,
    start_states: Floats,
    samples: int,
) -> Floats:
    """Return what `run_freely` returns, but velocities by the stamps and not as they are reported.

    drives: what `run_drive` returned for these twins.
    """
    rows, row_of = drives
    sub = rows.shape[1] // len(signals)
    true = np.empty((len(begin), samples, 4))
    begin = np.asarray(begin, dtype=np.int64)
    t = signals.clock_s[begin]
    true_starts = undo_sensors(start_states, theta, t, set_of)
    path_memory = recall_paths(signals, drives, theta, set_of, begin)
    for twins, own_set_of, lanes in _group_by_reaction(theta, set_of):
        out = true if isinstance(lanes, slice) else np.empty((len(lanes), samples, 4))
        run_mechanics(
            rows,
            row_of[set_of[lanes]],
            begin[lanes] * sub,
            np.round(t[lanes] / signals.period_s).astype(np.int64) * sub,
            true_starts[lanes],
            twins,
            signals.period_s / sub,
            sub,
            out,
            own_set_of,
            path_memory[lanes],
        )
        if out is not true:
            true[lanes] = out
    times = t[:, None] + signals.period_s * np.arange(samples)
    return apply_sensors(true, theta, times, set_of)


def _group_by_reaction(theta: Floats, set_of: Ints) -> list[tuple[Floats, Ints, Ints | slice]]:
    """Return twins, the twin of each of their runs, and these runs, in one group or two.

    Twins whose drive has a mass of its own are apart: they are few, and all runs of a call are as
    slow as its slowest.
    """
    reacting = find_reacting_twins(theta)
    if reacting.all() or not reacting.any():
        return [(theta, set_of, slice(None))]
    groups: list[tuple[Floats, Ints, Ints | slice]] = []
    for own in (~reacting, reacting):
        lanes = np.flatnonzero(own[set_of])
        groups.append((theta[own], (np.cumsum(own) - 1)[set_of[lanes]], lanes))
    return groups


def recall_paths(
    signals: Signals, drives: tuple[Floats, Ints], theta: Floats, set_of: Ints, begin: Ints
) -> Floats:
    """Return what twins remember of the recorded path where runs begin, (runs, PATH_SIZE).

    drives: what `run_drive` returned for these twins.
    """
    out = np.zeros((len(begin), PATH_SIZE))
    reacting = find_reacting_twins(theta) & (signals.cart is not None)
    remembering = np.array([remembers_path(twin) for twin in theta])
    if not np.any(remembering | reacting):
        return out
    states = np.zeros((1, len(signals), 4))
    for column, positions in enumerate((signals.cart, signals.pole)):
        if positions is not None:
            states[0, :, column] = positions
    for twins in _group_by_path(theta, drives[1], remembering, reacting):
        k, lanes = twins[0], np.flatnonzero(np.isin(set_of, twins))
        at, row = np.unique(begin[lanes], return_inverse=True)
        places = undo_sensors(states, theta[[k]], signals.clock_s)[0, :, :2]
        memory, _ = follow_recorded_path(signals, places, theta[k], at)
        if reacting[k]:
            drive = drives[0][drives[1][k]]
            kept = react_to_recorded_path(signals, places[:, 0], drive, theta[k])
            memory[:, PATHS:KEPT] = kept[at]
        out[lanes] = memory[row]
    return out


def _group_by_path(theta: Floats, row_of: Ints, remembering: Mask, reacting: Mask) -> list[Ints]:
    """Return the twins that remember or react, those together that keep the same of a path.

    row_of: (sets,) row of the drive of each twin.
    """
    paths = select_path_columns(theta)
    reactions = np.column_stack([select_reaction_columns(theta), row_of])
    columns = np.concatenate([paths, np.where(reacting[:, None], reactions, 0.0)], axis=1)
    which = np.flatnonzero(remembering | reacting)
    first, group = group_equal_rows(columns[which])
    return [which[group == k] for k in range(len(first))]


def count_substeps(signals: Signals, step_s: float | None = None) -> int:
    """Return the number of steps in a sample period, the same in each part of the command.

    step_s: s, the longest substep; None for the twin's own.
    """
    parts = signals.command_parts.shape[1]
    return parts * kernel.count_substeps(signals.period_s / parts, step_s)


def run_drive(signals: Signals, theta: Floats, step_s: float | None = None) -> tuple[Floats, Ints]:
    """Return the command after command and drive, before the gain, and the row of each twin.

    The rows have the shape (rows, samples * substeps). Twins with the same command and drive share
    a row.

    step_s: s, the longest substep, of drive and mechanics; None for the twin's own.
    """
    sub, parts = count_substeps(signals, step_s), signals.command_parts
    first, row_of = group_equal_rows(_select_filter_columns(theta))
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
                parts[stretch].reshape(-1),
                np.zeros(offsets[-1]),
                offsets,
                h,
                sub // parts.shape[1],
                steps,
                theta[chosen],
                on,
                out,
            )
    return rows, row_of


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
    set_of: Ints | None = None,
    path_memory: Floats | None = None,
) -> None:
    """Call `kernel.integrate_lanes` with the least code that holds the effects of the lanes.

    Lanes are independent: several threads share the blocks of lanes where the work is worth it.

    theta: (sets, SIZE) the twins.
    set_of: (lanes,) the twin of each lane; None where each lane has a twin of its own.
    path_memory: (lanes, PATH_SIZE) what lanes remember of their paths at the start; afterwards at
        the end. None: the path begins at the start.
    """
    code, lanes = select_kernel_code(theta), len(begin)
    rows = np.arange(lanes) if set_of is None else set_of
    if path_memory is None:
        path_memory = np.zeros((lanes, PATH_SIZE))
    drives, start_states, theta = map(np.ascontiguousarray, (drives, start_states, theta))

    def integrate(part: slice) -> None:
        kernel.integrate_lanes(
            (0,) * (1 if lanes == 1 else kernel.WIDTH),
            *code,
            drives,
            drive_of[part],
            begin[part],
            first_step[part],
            start_states[part],
            path_memory[part],
            theta,
            rows[part],
            h,
            sub,
            out[part],
        )

    share_among_threads(integrate, lanes, out.shape[1] * sub)


def select_kernel_code(
    theta: Floats,
) -> tuple[tuple[int, ...] | None, bool, tuple[int, ...] | None]:
    """Return laws, dry and measured of `kernel.integrate_lanes`: the least code.

    theta: (sets, SIZE).
    """
    on = find_active_effects(theta)
    roles = {kind.role for kind in list_law_kinds(theta)}
    sticks = not roles.isdisjoint(_DRY)
    dry = bool(np.any(on & _STICKING)) or sticks
    measured: tuple[int, ...] | None = CURVES if sticks or not roles.isdisjoint(_HELD) else None
    if not roles.isdisjoint(REMEMBERING):
        measured = HYSTERESIS
    if np.any(on & REACTING):
        return REACTING_LAWS, dry, measured
    if not np.any(on & _MECHANICAL):
        return PLAIN_LAWS if sticks else NO_LAWS, dry, measured
    if np.any(on & _MECHANICAL & _COSTLY):
        return ALL_LAWS, dry, measured
    return HELD_LAWS if np.any(on & _HOLDING) else PLAIN_LAWS, dry, measured
