"""Advance many live twins side by side by a period, sensors included, in one compiled call.

A lane is a twin that runs now. Lanes may be of different twins, which are called kinds here; the
effects of all kinds are compiled in.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pendulum_twin import compose, kernel
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.equations import compile_inner
from pendulum_twin.free_runs import compute_memory_offsets
from pendulum_twin.law_curves import follow_pace, show_positions
from pendulum_twin.machine_code import compile_cached
from pendulum_twin.mechanics import select_kernel_code
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import find_active_effects, make_theta
from pendulum_twin.sensors import compute_paces

HANGING = (0.0, math.pi, 0.0, 0.0)
AT_REST = (0.0, 0.0, 0.0, 0.0)  # distance from HANGING

measure_state = compose.compose_sensors()
report_rate = compose.compose_reports()


class Kinds(NamedTuple):
    """Hold what does not change, for each of the twins that lanes may be of.

    theta: (twins, SIZE).
    on: (effects,) whether an effect is on in any of the twins.
    offsets: (twins, filters + 1) where each filter's memory begins in a lane's memory.
    paces: (twins,) true time per second of the stamps.
    steps: m and rad, of the encoders.
    """

    theta: Floats
    on: np.ndarray
    offsets: Ints
    paces: Floats
    steps: tuple[float, float]


class Lanes(NamedTuple):
    """Hold what changes; each array has a row a lane.

    kind: (lanes,) index into `Kinds`.
    theta: (lanes, SIZE).
    memory: (lanes, ...) of command and drive.
    done: (lanes,) substeps done.
    true: (lanes, 4) true state.
    path_memory: (lanes, PATH_SIZE) what the lanes remember of their paths.
    shown: (lanes, 4) measured state.
    drives: (lanes, substeps) room for a period of drive.
    out: (lanes, samples + 1, 4) room for a period of states.
    row, zero: (lanes,) the row of drives and of theta of each lane, and where the lane begins in
        its drive.
    commands: (samples,) room for a period of commands.
    """

    kind: Ints
    theta: Floats
    memory: Floats
    done: Ints
    true: Floats
    path_memory: Floats
    shown: Floats
    drives: Floats
    out: Floats
    row: Ints
    zero: Ints
    commands: Floats


class Code(NamedTuple):
    """Hold what the compiled call is specialised to: arguments of the kernel."""

    block: tuple[int, ...]
    laws: tuple[int, ...] | None
    dry: bool
    measured: tuple[int, ...] | None


class Timing(NamedTuple):
    """Hold how a period is cut.

    samples: in a period.
    sub: substeps in a sample.
    sample_s: s by the stamps, from sample to sample.
    """

    samples: int
    sub: int
    sample_s: float


def make_timing(period_s: float, samples: int) -> Timing:
    """Return the timing of a period, s, with so many samples."""
    sample_s = period_s / samples
    return Timing(samples, kernel.count_substeps(sample_s), sample_s)


def make_kinds(twins: Sequence[Twin], timing: Timing, encoders: Encoders = EXACT) -> Kinds:
    """Return what lanes of these twins need."""
    theta = np.array([make_theta(twin) for twin in twins])
    paces = compute_paces(theta)
    h = timing.sample_s / timing.sub
    offsets = np.array([compute_memory_offsets(h * float(pace)) for pace in paces])
    return Kinds(theta, find_active_effects(theta), offsets, paces, encoders.steps)


def make_lanes(kinds: Kinds, timing: Timing, count: int) -> Lanes:
    """Return so many lanes of the first kind, which `begin_lane` has to start."""
    substeps = timing.samples * timing.sub
    return Lanes(
        kind=np.zeros(count, dtype=np.int64),
        theta=np.tile(kinds.theta[0], (count, 1)),
        memory=np.zeros((count, max(1, int(kinds.offsets[:, -1].max())))),
        done=np.zeros(count, dtype=np.int64),
        true=np.tile(np.array(HANGING), (count, 1)),
        path_memory=np.zeros((count, PATH_SIZE)),
        shown=np.tile(np.array(HANGING), (count, 1)),
        drives=np.zeros((count, substeps)),
        out=np.zeros((count, timing.samples + 1, 4)),
        row=np.arange(count, dtype=np.int64),
        zero=np.zeros(count, dtype=np.int64),
        commands=np.zeros(timing.samples),
    )


def select_lane_code(kinds: Kinds, count: int) -> Code:
    """Return the code for so many lanes of these kinds."""
    return Code((0,) * (1 if count == 1 else kernel.WIDTH), *select_kernel_code(kinds.theta))


@compile_inner
def _show_state(kinds, lanes, i, state, t, period_s):
    """Fill `lanes.shown` of lane i from a true state; period_s: since the last, 0 at the start."""
    x, th, v, w = state
    p, pace = lanes.theta[i], kinds.paces[lanes.kind[i]]
    pace *= follow_pace(p, t * pace)
    x, v, th, w = show_positions(p, x, v, th, w)
    x, v, th, w = measure_state(x, v, th, w, t, p, kinds.on)
    v, w = v * pace, w * pace
    fine_m, fine_rad = kinds.steps
    shown = lanes.shown[i]
    if fine_m > 0.0:
        x = np.rint(x / fine_m) * fine_m
    if fine_rad > 0.0:
        th = np.rint(th / fine_rad) * fine_rad
    if period_s > 0.0:
        if (fine_m > 0.0) | (fine_rad > 0.0):
            v, w = (x - shown[0]) / period_s, (th - shown[1]) / period_s
        v, w = (
            report_rate(v, shown[2], period_s, p, kinds.on),
            report_rate(w, shown[3], period_s, p, kinds.on),
        )
    shown[0], shown[1], shown[2], shown[3] = x, th, v, w


@compile_inner
def begin_lane(kinds, lanes, timing, i, kind, away):
    """Start lane i as a twin of a kind, after a command of 0.

    away: distance of the true start state x, th, v, w from hanging at rest. A pole hangs by its
    weight, whatever its sensors show.
    """
    lanes.kind[i] = kind
    lanes.theta[i] = kinds.theta[kind]
    lanes.memory[i] = 0.0
    lanes.path_memory[i] = 0.0
    lanes.done[i] = 0
    lanes.commands[:] = 0.0
    h = timing.sample_s / timing.sub * kinds.paces[kind]
    kernel.filter_command(
        lanes.commands[:1],
        lanes.memory[i],
        kinds.offsets[kind],
        h,
        1,
        0,
        lanes.theta[i],
        kinds.on,
        lanes.drives[i, :1],
    )
    for k in range(4):
        lanes.true[i, k] = HANGING[k] + away[k]
    x, th, v, w = lanes.true[i]
    _show_state(kinds, lanes, i, (x, th, v, w), 0.0, 0.0)


@compile_inner
def advance_lanes(code, kinds, lanes, timing, commands):
    """Hold the commands over a period; afterwards `lanes.shown` is the measured state.

    commands: (lanes,) PWM fraction, as the drive receives it.
    """
    samples, sub, sample_s = timing
    h = sample_s / sub
    for i in range(len(commands)):
        kind = lanes.kind[i]
        lanes.commands[:] = commands[i]
        pace = kinds.paces[kind]
        drive = lanes.drives[i]
        kernel.filter_command(
            lanes.commands,
            lanes.memory[i],
            kinds.offsets[kind],
            h * pace,
            sub,
            lanes.done[i],
            lanes.theta[i],
            kinds.on,
            drive,
        )
    kernel.integrate_lanes(
        code.block,
        code.laws,
        code.dry,
        code.measured,
        lanes.drives,
        lanes.row,
        lanes.zero,
        lanes.done,
        lanes.true,
        lanes.path_memory,
        lanes.theta,
        lanes.row,
        h,
        sub,
        lanes.out,
    )
    for i in range(len(commands)):
        for n in range(1, samples + 1):
            t = (lanes.done[i] // sub + n) * sample_s
            x, th, v, w = lanes.out[i, n]
            _show_state(kinds, lanes, i, (x, th, v, w), t, sample_s)
        lanes.true[i] = lanes.out[i, samples]
        lanes.done[i] += samples * sub


@compile_cached
def begin_lane_from_python(kinds, lanes, timing, i, kind, away):
    """Call `begin_lane` from Python."""
    begin_lane(kinds, lanes, timing, i, kind, away)


@compile_cached
def advance_lanes_from_python(code, kinds, lanes, timing, commands):
    """Call `advance_lanes` from Python."""
    advance_lanes(code, kinds, lanes, timing, commands)
