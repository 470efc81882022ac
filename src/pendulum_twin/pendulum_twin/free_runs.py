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
from pendulum_twin.lagging_angle import begin_poles, compute_lags, follow_angle
from pendulum_twin.late_angle import FINEST_S, POLE, compute_delays, drop_delays, look_back
from pendulum_twin.laws.kind import Role
from pendulum_twin.mechanics import run_mechanics
from pendulum_twin.parameter_vector import (
    BASE,
    LAWS,
    SLOTS,
    find_active_effects,
    list_law_kinds,
)
from pendulum_twin.path_memory import (
    drop_angle_sensors,
    find_remembering_twins,
    follow_recorded_path,
    select_path_columns,
)
from pendulum_twin.reactions import (
    find_reacting_twins,
    react_to_recorded_path,
    select_reaction_columns,
)
from pendulum_twin.sensors import apply_reporting, apply_sensors, compute_paces, undo_sensors
from pendulum_twin.signals import Signals

TOGETHER = 100_000  # states whose sensors are undone at once: 3 MB
_FILTERING = [(k, e) for k, e in enumerate(CATALOGUE) if e.form in (Form.FILTER, Form.CLOCK)]


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
    t, paces = signals.clock_s[begin], compute_paces(theta)[set_of]
    delays, lags = compute_delays(theta)[set_of], compute_lags(theta)[set_of]
    late, lagging = (np.flatnonzero(behind > FINEST_S) for behind in (delays, lags))
    in_time = drop_delays(theta) if np.any(delays + lags) else theta
    before = undo_sensors(start_states, in_time, t, set_of)
    path_memory = recall_paths(signals, drives, theta, set_of, begin)
    behind = delays + lags
    true_starts = _lead_poles(signals, drives, theta, set_of, begin, before, path_memory, behind)
    received = before.copy()
    received[lagging], true_starts[lagging] = begin_poles(
        before[lagging], true_starts[lagging], delays[lagging], lags[lagging], paces[lagging]
    )
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
    shown, period_s = true, signals.period_s
    shown[late] = look_back(received[late], true[late], delays[late], period_s, paces[late])
    if len(lagging):  # sample by sample, which takes longer than a run
        shown[lagging] = follow_angle(
            before[lagging], shown[lagging], lags[lagging], period_s, paces[lagging]
        )
    times = t[:, None] + signals.period_s * np.arange(samples)
    return apply_sensors(shown, in_time, times, set_of)


def _lead_poles(
    signals: Signals,
    drives: tuple[Floats, Ints],
    theta: Floats,
    set_of: Ints,
    begin: Ints,
    before: Floats,
    path_memory: Floats,
    delays: Floats,
) -> Floats:
    """Return true states (runs, 4) where runs begin, from a pole that was read late.

    The twin itself tells where the pole has moved on to, as the command then drove it, from a cart
    on its way with the velocity that it has. Before a stretch begins nothing drives it.

    before: (runs, 4) true states, the pole's a delay ago; delays: (runs,) s.
    path_memory: (runs, PATH_SIZE) at the start.
    """
    starts, (rows, row_of) = before, drives
    sub = rows.shape[1] // len(signals)
    firsts = np.array([part.start for part in signals.stretches])
    first = firsts[np.searchsorted(firsts, begin, side="right") - 1] * sub
    for delay_s in np.unique(delays[delays > FINEST_S]):
        runs = np.flatnonzero(delays == delay_s)
        steps = kernel.count_substeps(delay_s)
        since_s = (np.arange(steps) + 0.5) / steps * delay_s - delay_s
        at = begin[runs, None] * sub + np.floor(since_s * sub / signals.period_s).astype(np.int64)
        known = at >= first[runs, None]
        along = np.where(known, rows[row_of[set_of[runs]][:, None], np.maximum(at, 0)], 0.0)
        drawn_back = before[runs].copy()
        drawn_back[:, 0] -= delay_s * drawn_back[:, 2]
        out, count = np.empty((len(runs), 2, 4)), np.arange(len(runs))
        run_mechanics(
            along,
            count,
            np.zeros(len(runs), dtype=np.int64),
            np.round((signals.clock_s[begin[runs]] / delay_s - 1.0) * steps).astype(np.int64),
            drawn_back,
            theta,
            delay_s / steps,
            steps,
            out,
            set_of[runs],
            path_memory[runs],
        )
        starts = starts.copy() if starts is before else starts
        starts[np.ix_(runs, POLE)] = out[:, 1, POLE]
    return starts


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
    remembering = find_remembering_twins(theta)
    if not np.any(remembering | reacting):
        return out
    shown = drop_angle_sensors(theta)
    first, group_of = _group_by_path(shown, drives[1], remembering, reacting)
    for some in np.array_split(np.arange(len(first)), -(-len(first) * len(signals) // TOGETHER)):
        true = undo_sensors(
            np.broadcast_to(_get_places(signals), (len(some), len(signals), 4)),
            shown[first[some]],
            np.broadcast_to(signals.clock_s, (len(some), len(signals))),
        )
        for group, places in zip(some, true[..., :2], strict=True):
            k, lanes = first[group], np.flatnonzero(group_of[set_of] == group)
            at, row = np.unique(begin[lanes], return_inverse=True)
            memory, _ = follow_recorded_path(signals, places, theta[k], at)
            if reacting[k]:
                drive = drives[0][drives[1][k]]
                kept = react_to_recorded_path(signals, places[:, 0], drive, theta[k])
                memory[:, PATHS:KEPT] = kept[at]
            out[lanes] = memory[row]
    return out


def _get_places(signals: Signals) -> Floats:
    """Return the measured states (n, 4) at rest; 0 for a joint that is not measured."""
    states = np.zeros((len(signals), 4))
    for column, positions in enumerate((signals.cart, signals.pole)):
        if positions is not None:
            states[:, column] = positions
    return states


def _group_by_path(
    theta: Floats, row_of: Ints, remembering: Mask, reacting: Mask
) -> tuple[Ints, Ints]:
    """Return the first twin of each group that keeps the same of a path, and each twin's group.

    A twin that neither remembers nor reacts is in group -1.

    row_of: (sets,) row of the drive of each twin.
    """
    paths = select_path_columns(theta)
    reactions = np.column_stack([select_reaction_columns(theta), row_of])
    columns = np.concatenate([paths, np.where(reacting[:, None], reactions, 0.0)], axis=1)
    which, group_of = np.flatnonzero(remembering | reacting), np.full(len(theta), -1)
    first, group_of[which] = group_equal_rows(columns[which])
    return which[first], group_of


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
