"""Run the compiled passes; the only place where time advances.

`filter_command` runs command and drive once over a stretch and gives the force before the gain;
`integrate_lanes` integrates the motion, many lanes side by side (`motion.py`, `stick_slip.py`);
the sensor's effects turn true states into measured states (`sensors.py`). A lane is a run. Lanes
are packed in blocks of constant width; a lane gives the same bits in any width, for nothing here
depends on its neighbours.

A block's numbers lie in one array, row by row, lane beside lane: theta, and below it the rows
named here. There is one array because the compiler computes lanes side by side only where it can
prove that it does not write what it reads.
"""

from __future__ import annotations

import numba
import numpy as np

from pendulum_twin import compose
from pendulum_twin.equations import compile_inner
from pendulum_twin.hysteresis import (
    STRAINS,
    follow_strains,
    list_elements,
    sum_hysteresis,
)
from pendulum_twin.law_curves import bend_commands, sum_measured_laws
from pendulum_twin.machine_code import compile_cached
from pendulum_twin.motion import (
    MOVING,
    advance_step,
    follow_path,
    react_to_push,
    sum_held_effects,
    sum_loads,
    sum_path_forces,
    sum_pulls,
    sum_shares,
)
from pendulum_twin.parameter_vector import CART_VISCOUS, FORCE_PER_PWM, LAWS, MASS
from pendulum_twin.stick_slip import compute_margins, cut_step, find_modes, get_sign

WIDTH = 16
LONGEST_STEP_S = 1e-3

# A block holds theta without its measured laws, whose curves each lane reads from its own theta.
ROWS = LAWS + 19 + compose.KEPT
# What a lane remembers of its path: forces of effects on the cart, N, what the
# reactions of the drive keep, then strains (`hysteresis`).
PATH_SIZE = compose.KEPT + STRAINS
X, TH, V, W = range(LAWS, LAWS + 4)
# the state at the begin of the step
X_BEFORE, TH_BEFORE, V_BEFORE, W_BEFORE = range(LAWS + 4, LAWS + 8)
CART_WAY, POLE_WAY, CART_FREE, POLE_FREE = range(LAWS + 8, LAWS + 12)  # the modes; see `motion.py`
# what acts evenly over the step (`applied` in `motion.py`); the first is the force on the cart, N
FORCE, TORQUE, CART_DRY, POLE_DRY = range(LAWS + 12, LAWS + 16)
ENDED = LAWS + 16  # 1 where a mode has ended within the step
H = LAWS + 17  # the step, s
PUSHED = LAWS + 18  # N, the part of the force that effects and laws add to the drive's
PATH = LAWS + 19  # forces on the cart that follow its path, N
REACTION = PATH + compose.PATHS  # what the reactions of the drive keep

apply_command_filters = compose.compose_filters(of_command=True)
apply_drive_filters = compose.compose_filters(of_command=False)
is_frozen = compose.compose_holds()
compute_pace = compose.compose_pace()


def count_substeps(period_s: float, longest_s: float | None = None) -> int:
    """Return the number of steps in a sample period.

    longest_s: s, of a step; None for LONGEST_STEP_S.
    """
    return max(1, int(np.ceil(period_s / (longest_s or LONGEST_STEP_S) - 1e-9)))


@compile_cached
def filter_command(command, memory, offsets, h, sub, first_step, theta, active, out):
    """Fill out with the command after command and drive, before the gain.

    command: (samples,) held from sample to sample.
    memory: of all filters, carried from call to call; offsets: where each filter's memory begins.
    h: s, a substep of true time; sub: substeps a sample.
    first_step: substeps before this call.
    theta: (SIZE,); active: (effects,) which effects are on.
    out: (samples * sub,).
    """
    for k in range(len(command)):
        out[k * sub : (k + 1) * sub] = command[k]
    apply_command_filters(out, memory, offsets, h, first_step, theta, active)
    bend_commands(theta, out)
    apply_drive_filters(out, memory, offsets, h, first_step, theta, active)


@compile_inner
def _get_four(p, row, i, width):
    """Return four neighbouring rows of lane i: a state or modes."""
    return (
        p[row * width + i],
        p[(row + 1) * width + i],
        p[(row + 2) * width + i],
        p[(row + 3) * width + i],
    )


@compile_inner
def _put_four(p, row, i, width, four):
    for k in range(4):
        p[(row + k) * width + i] = four[k]


@numba.njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
def _advance(lanes, laws, dry, p):
    """Advance every lane of a block by one step."""
    width = len(lanes)
    resting = False
    if laws is not None:
        resting = dry and _begin_step(lanes, laws, p)
    for i in range(width):
        modes = _get_four(p, CART_WAY, i, width) if laws is not None else MOVING
        after = advance_step(
            _get_four(p, X, i, width),
            _get_four(p, FORCE, i, width),
            modes,
            p,
            i,
            width,
            laws,
            p[H * width + i],
        )
        _put_four(p, X, i, width, after)
    if laws is not None and dry:
        _end_step(lanes, laws, p, resting)


@compile_inner
def _begin_step(lanes, laws, p):
    """Keep the states, set the modes and return whether any joint is at rest."""
    width = len(lanes)
    at_rest = 0
    for i in range(width):
        x, th, v, w = _get_four(p, X, i, width)
        _put_four(p, X_BEFORE, i, width, (x, th, v, w))
        _put_four(p, CART_WAY, i, width, (get_sign(v), get_sign(w), 1.0, 1.0))
        at_rest += 1 if (v == 0.0) | (w == 0.0) else 0
    if at_rest > 0:
        for i in range(width):
            state = _get_four(p, X, i, width)
            _put_four(
                p,
                CART_WAY,
                i,
                width,
                find_modes(state, _get_four(p, FORCE, i, width), p, i, width, laws),
            )
    return at_rest > 0


@compile_inner
def _end_step(lanes, laws, p, resting):
    """Cut the steps in which a mode ended; put back the states that stand still."""
    width = len(lanes)
    ends = 0
    if resting:
        for i in range(width):
            state, modes = _get_four(p, X, i, width), _get_four(p, CART_WAY, i, width)
            cart_margin, pole_margin = compute_margins(
                state, _get_four(p, FORCE, i, width), modes, p, i, width, laws
            )
            ended = (cart_margin < 0.0) | (pole_margin < 0.0)
            p[ENDED * width + i] = 1.0 if ended else 0.0
            ends += 1 if ended else 0
    else:
        for i in range(width):
            turned = (p[V * width + i] * p[CART_WAY * width + i] < 0.0) | (
                p[W * width + i] * p[POLE_WAY * width + i] < 0.0
            )
            p[ENDED * width + i] = 1.0 if turned else 0.0
            ends += 1 if turned else 0
    if ends > 0:
        for i in range(width):
            if p[ENDED * width + i] > 0.0:
                state, after = _get_four(p, X_BEFORE, i, width), _get_four(p, X, i, width)
                modes = _get_four(p, CART_WAY, i, width)
                applied, h = _get_four(p, FORCE, i, width), p[H * width + i]
                _put_four(
                    p, X, i, width, cut_step(state, after, applied, modes, p, i, width, laws, h)
                )
    for i in range(width):
        x, th, v, w = _get_four(p, X_BEFORE, i, width)
        stands = is_frozen(p[FORCE * width + i], v, w, p, i, width)
        after = _get_four(p, X, i, width)
        _put_four(p, X, i, width, (x, th, v, w) if stands else after)


@compile_inner
def _hold_effects(p, i, width, laws, step, mass, viscous):
    """Set what effects of lane i do evenly over its next step, in the middle of the step.

    laws: see `motion.py`.
    step: substeps since the recording began.
    mass: kg; what moves along the rail without effects.
    viscous: N s/m; the cart's viscous friction without effects.
    """
    h = p[H * width + i]
    t = (step + 0.5) * h
    p[MASS * width + i] = mass
    p[MASS * width + i] = mass + sum_loads(t, h, p, i, width)
    x, th, v, w = _get_four(p, X, i, width)
    half_way = 0.5 * h * v
    x, th = x + half_way, th + 0.5 * h * w
    gain, force, dry, drag = sum_held_effects(x, th, w, t, p, i, width)
    force += sum_path_forces(PATH, half_way, p, i, width)
    drive = p[FORCE * width + i] * gain
    if len(laws) > 3:  # the cart alone moves, and what joins it to the drive pulls it
        share = sum_shares(p, i, width)
        p[MASS * width + i] -= share * mass
        drive *= 1.0 - share
        force -= sum_pulls(REACTION, p, i, width)
        p[V_BEFORE * width + i] = v
    p[FORCE * width + i] = drive + force
    p[PUSHED * width + i] = force
    p[X_BEFORE * width + i] = p[X * width + i]
    p[CART_DRY * width + i] = dry
    p[CART_VISCOUS * width + i] = viscous + drag


@compile_inner
def _react_to_motion(p, i, width, mass):
    """Let lane i's cart act back on the drive; what acts on it shows in its change of velocity.

    mass: kg; what moves along the rail without effects.
    """
    h = p[H * width + i]
    drive = p[FORCE * width + i] - p[PUSHED * width + i] - sum_pulls(REACTION, p, i, width)
    change = p[V * width + i] - p[V_BEFORE * width + i]
    push = (1.0 - sum_shares(p, i, width)) * mass * change / h - drive
    react_to_push(REACTION, push, h, p, i, width)


@compile_inner
def _hold_measured_laws(theta, p, i, width, step, pushed, held_dry):
    """Add the measured laws of lane i to what acts evenly over its next step.

    step: substeps since the recording began.
    pushed: N; what effects add to the drive's force over the step.
    held_dry: N; what effects add to the cart's dry friction over the step.

    The laws are taken in the middle of the step as its first velocities lead there: of second
    order in the step, and a force along the rail keeps the energy.
    """
    x, th, v, w = _get_four(p, X, i, width)
    h = p[H * width + i]
    gain, force, torque, cart_dry, pole_dry = sum_measured_laws(
        theta, x + 0.5 * h * v, v, th + 0.5 * h * w, w, (step + 0.5) * h, h
    )
    drive = p[FORCE * width + i] - pushed
    applied = drive * gain + pushed + force, torque, held_dry + cart_dry, pole_dry
    _put_four(p, FORCE, i, width, applied)
    p[PUSHED * width + i] = pushed + force


@compile_inner
def _hold_hysteresis(elements, slots, counts, strains, p, i, width):
    """Add the measured hysteresis of lane i to what acts evenly over its next step.

    elements, slots, counts, strains: of the lane at the step's begin; see `hysteresis`.
    """
    x, th, v, w = _get_four(p, X, i, width)
    half = 0.5 * p[H * width + i]
    force, torque = sum_hysteresis(elements, slots, counts, strains, half * v, half * w)
    p[FORCE * width + i] += force
    p[PUSHED * width + i] += force
    p[TORQUE * width + i] += torque
    p[X_BEFORE * width + i], p[TH_BEFORE * width + i] = x, th


@compile_inner
def _follow_strains(elements, slots, counts, strains, p, i, width):
    """Strain the elements of measured hysteresis of lane i by its last step."""
    move = p[X * width + i] - p[X_BEFORE * width + i]
    turn = p[TH * width + i] - p[TH_BEFORE * width + i]
    follow_strains(elements, slots, counts, strains, move, turn)


@compile_inner
def _place_lane(theta, start_state, path_memory, h, p, i, width):
    """Place the start of a run in lane i: both joints move, and no force acts yet.

    h: s by the stamps, a substep.
    """
    for k in range(LAWS):
        p[k * width + i] = theta[k]
    for k in range(4):
        p[(X + k) * width + i] = start_state[k]
    for k in range(compose.KEPT):
        p[(PATH + k) * width + i] = path_memory[k]
    _put_four(p, CART_WAY, i, width, MOVING)
    _put_four(p, FORCE, i, width, (0.0, 0.0, 0.0, 0.0))
    p[H * width + i] = h * compute_pace(p, i, width)


@compile_cached
def integrate_lanes(
    lanes,
    laws,
    dry,
    measured,
    drives,
    drive_of,
    begin,
    first_step,
    start_states,
    path_memory,
    theta,
    h,
    sub,
    out,
):
    """Integrate lanes side by side from their start states; fill out with the true states.

    lanes: a tuple whose length is the block's width (a constant for the compiler).
    laws: by its type, which laws are compiled in (see `motion.py`).
    dry: whether dry friction (or a hold) is on in any lane.
    measured: by its type, which measured laws of theta act: None for none, a tuple of one for
        curves, of two for hysteresis as well.
    drives: (rows, steps) the command after command and drive, before the gain.
    drive_of: (lanes,) row of drives of each lane.
    begin: (lanes,) step of that row at which each lane starts.
    first_step: (lanes,) substeps since the recording began, at each lane's start.
    start_states: (lanes, 4) x, th, v, w.
    path_memory: (lanes, PATH_SIZE) what the lanes remember of their paths at the start;
        afterwards at the end.
    theta: (lanes, SIZE).
    h: s by the stamps, a substep; sub: substeps a sample.
    out: (lanes, samples, 4); the first sample is the start state.
    """
    width = len(lanes)
    count, samples = out.shape[0], out.shape[1]
    p = np.empty(ROWS * width)
    row, at = np.empty(width, dtype=np.int64), np.empty(width, dtype=np.int64)
    first_of, mass_of, viscous_of = np.empty(width), np.empty(width), np.empty(width)
    remembers = measured is not None and len(measured) > 1
    elements = np.empty((width, STRAINS if remembers else 0, 2))
    slots = np.empty((width, STRAINS if remembers else 0), dtype=np.int64)
    counts = np.empty((width, 2), dtype=np.int64)
    for first in range(0, count, width):
        for i in range(width):
            # a block that is not full is filled up with its last lane
            lane = min(first + i, count - 1)
            row[i], at[i], first_of[i] = drive_of[lane], begin[lane], first_step[lane]
            mass_of[i], viscous_of[i] = theta[lane, MASS], theta[lane, CART_VISCOUS]
            _place_lane(theta[lane], start_states[lane], path_memory[lane], h, p, i, width)
            if remembers:
                counts[i, 0], counts[i, 1] = list_elements(theta[lane], elements[i], slots[i])
        for n in range(samples):
            for i in range(min(width, count - first)):
                for k in range(4):
                    out[first + i, n, k] = p[(X + k) * width + i]
            if n == samples - 1:
                break
            for j in range(sub):
                for i in range(width):
                    p[FORCE * width + i] = drives[row[i], at[i] + j] * p[FORCE_PER_PWM * width + i]
                evenly = laws is not None and len(laws) > 1
                if laws is not None and len(laws) > 1:  # `evenly`, for the oldest compiler to see
                    for i in range(width):
                        done = first_of[i] + (n * sub + j)
                        _hold_effects(p, i, width, laws, done, mass_of[i], viscous_of[i])
                if measured is not None:
                    for i in range(width):
                        lane = min(first + i, count - 1)
                        step = first_step[lane] + n * sub + j
                        pushed = p[PUSHED * width + i] if evenly else 0.0
                        held_dry = p[CART_DRY * width + i] if evenly else 0.0
                        _hold_measured_laws(theta[lane], p, i, width, step, pushed, held_dry)
                if remembers:
                    for i in range(width):
                        strains = path_memory[min(first + i, count - 1), compose.KEPT :]
                        _hold_hysteresis(elements[i], slots[i], counts[i], strains, p, i, width)
                _advance(lanes, laws, dry, p)
                if evenly:
                    for i in range(width):
                        follow_path(PATH, p[X * width + i] - p[X_BEFORE * width + i], p, i, width)
                if laws is not None and len(laws) > 3:
                    for i in range(width):
                        _react_to_motion(p, i, width, mass_of[i])
                if remembers:
                    for i in range(min(width, count - first)):
                        strains = path_memory[first + i, compose.KEPT :]
                        _follow_strains(elements[i], slots[i], counts[i], strains, p, i, width)
            for i in range(width):
                at[i] += sub
        for i in range(min(width, count - first)):
            for k in range(compose.KEPT):
                path_memory[first + i, k] = p[(PATH + k) * width + i]
