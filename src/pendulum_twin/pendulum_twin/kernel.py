"""Run the compiled passes; the only place where time advances.

`filter_command` runs command and drive once over a stretch and gives the force before the gain;
`integrate_lanes` integrates the motion, many lanes side by side (`motion.py`, `stick_slip.py`);
the sensor's effects turn true states into measured states (`sensors.py`). A lane is a run. Lanes
are packed in blocks of constant width (`block.py`); a lane gives the same bits in any width, for
nothing here depends on its neighbours.
"""

from __future__ import annotations

import numba
import numpy as np

from pendulum_twin import compose
from pendulum_twin.block import (
    CART_DRY,
    CART_WAY,
    ENDED,
    EVEN_H,
    FORCE,
    PATH,
    POLE_WAY,
    PUSHED,
    ROWS,
    X_BEFORE,
    H,
    V,
    W,
    X,
    get_four,
    make_block,
    put_four,
)
from pendulum_twin.equations import compile_inner
from pendulum_twin.held_laws import (
    follow_block_strains,
    hold_effects,
    hold_hysteresis,
    hold_measured_laws,
    hold_no_curves,
    hold_pace,
    react_to_motion,
)
from pendulum_twin.hysteresis import keep_strains, list_elements, place_elements
from pendulum_twin.law_curves import bend_commands, has_curves, has_pace
from pendulum_twin.machine_code import compile_cached
from pendulum_twin.motion import MOVING, advance_step, follow_path
from pendulum_twin.parameter_vector import CART_VISCOUS, FORCE_PER_PWM, LAWS, MASS
from pendulum_twin.stick_slip import compute_margins, cut_step, find_modes, get_sign

WIDTH = 16
LONGEST_STEP_S = 1e-3

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


@numba.njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)
def _advance(lanes, laws, dry, p):
    """Advance every lane of a block by one step."""
    width = len(lanes)
    resting = False
    if laws is not None:
        resting = dry and _begin_step(lanes, laws, p)
    for i in range(width):
        modes = get_four(p, CART_WAY, i, width) if laws is not None else MOVING
        after = advance_step(
            get_four(p, X, i, width),
            get_four(p, FORCE, i, width),
            modes,
            p,
            i,
            width,
            laws,
            p[H * width + i],
        )
        put_four(p, X, i, width, after)
    if laws is not None and dry:
        _end_step(lanes, laws, p, resting)


@compile_inner
def _begin_step(lanes, laws, p):
    """Keep the states, set the modes and return whether any joint is at rest."""
    width = len(lanes)
    at_rest = 0
    for i in range(width):
        x, th, v, w = get_four(p, X, i, width)
        put_four(p, X_BEFORE, i, width, (x, th, v, w))
        put_four(p, CART_WAY, i, width, (get_sign(v), get_sign(w), 1.0, 1.0))
        at_rest += 1 if (v == 0.0) | (w == 0.0) else 0
    if at_rest > 0:
        for i in range(width):
            state = get_four(p, X, i, width)
            put_four(
                p,
                CART_WAY,
                i,
                width,
                find_modes(state, get_four(p, FORCE, i, width), p, i, width, laws),
            )
    return at_rest > 0


@compile_inner
def _end_step(lanes, laws, p, resting):
    """Cut the steps in which a mode ended; put back the states that stand still."""
    width = len(lanes)
    ends = 0
    if resting:
        for i in range(width):
            state, modes = get_four(p, X, i, width), get_four(p, CART_WAY, i, width)
            cart_margin, pole_margin = compute_margins(
                state, get_four(p, FORCE, i, width), modes, p, i, width, laws
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
                state, after = get_four(p, X_BEFORE, i, width), get_four(p, X, i, width)
                modes = get_four(p, CART_WAY, i, width)
                applied, h = get_four(p, FORCE, i, width), p[H * width + i]
                put_four(
                    p, X, i, width, cut_step(state, after, applied, modes, p, i, width, laws, h)
                )
    for i in range(width):
        x, th, v, w = get_four(p, X_BEFORE, i, width)
        stands = is_frozen(p[FORCE * width + i], v, w, p, i, width)
        after = get_four(p, X, i, width)
        put_four(p, X, i, width, (x, th, v, w) if stands else after)


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
    put_four(p, CART_WAY, i, width, MOVING)
    put_four(p, FORCE, i, width, (0.0, 0.0, 0.0, 0.0))
    p[EVEN_H * width + i] = h * compute_pace(p, i, width)
    p[H * width + i] = p[EVEN_H * width + i]


@compile_inner
def _place_block(
    first, measured, block, begin, first_step, starts, path_memory, theta, set_of, h, p
):
    """Place the lanes from the first on in the block; return whether a law changes a clock's pace.

    first: lane; block, p: see `block.py`. The other arguments are those of `integrate_lanes`.
    """
    width = len(block.lane)
    paced, block.curved[width] = False, False
    for i in range(width):
        lane = min(first + i, len(set_of) - 1)
        own = theta[set_of[lane]]
        block.lane[i], block.row[i] = lane, set_of[lane]
        block.at[i], block.done[i] = begin[lane], first_step[lane]
        block.constants[0, i], block.constants[1, i] = own[MASS], own[CART_VISCOUS]
        _place_lane(own, starts[lane], path_memory[lane], h, p, i, width)
        block.curved[i] = measured is not None and has_curves(own)
        block.curved[width] = block.curved[width] or block.curved[i]
        paced = paced or (measured is not None and has_pace(own))
        if measured is not None and len(measured) > 1:
            place_elements(own, path_memory[lane, compose.KEPT :], block.elements, i)
    return paced


@compile_inner
def _keep_paths(first, count, measured, block, path_memory, p, width):
    """Fill path_memory with what the block's lanes remember; the arguments of `_place_block`."""
    for i in range(min(width, count - first)):
        for k in range(compose.KEPT):
            path_memory[first + i, k] = p[(PATH + k) * width + i]
        if measured is not None and len(measured) > 1:
            keep_strains(block.elements, i, path_memory[first + i, compose.KEPT :])


@compile_inner
def _hold_paces(lanes, block, step, theta, p):
    """Set each lane's step, s, by its clock's measured pace; step: substeps since the starts."""
    width = len(lanes)
    for i in range(width):
        hold_pace(theta[block.row[i]], p, i, width, block.done[i] + step)


@compile_inner
def _drive_lanes(lanes, drives, drive_of, block, step, p):
    """Set the drive's force on every lane over the next step; the arguments of `integrate_lanes`.

    step: substeps since the lanes' starts.
    """
    width = len(lanes)
    for i in range(width):
        drive = drives[drive_of[block.lane[i]], block.at[i] + step]
        p[FORCE * width + i] = drive * p[FORCE_PER_PWM * width + i]


@compile_inner
def _hold(lanes, laws, measured, block, counts, step, theta, p):
    """Set what effects and measured laws of every lane do evenly over the next step.

    step: substeps since the lanes' starts.
    """
    width = len(lanes)
    # Each branch asks anew: numba 0.59 drops a branch only where its own condition says so.
    if laws is not None and len(laws) > 1:
        for i in range(width):
            mass, viscous = block.constants[0, i], block.constants[1, i]
            hold_effects(p, i, width, laws, block.done[i] + step, mass, viscous)
    if measured is not None:
        evenly = laws is not None and len(laws) > 1
        if not block.curved[width]:  # lanes without curves are computed side by side
            for i in range(width):
                pushed = p[PUSHED * width + i] if evenly else 0.0
                hold_no_curves(p, i, width, pushed, p[CART_DRY * width + i] if evenly else 0.0)
        else:
            for i in range(width):
                pushed = p[PUSHED * width + i] if evenly else 0.0
                held_dry = p[CART_DRY * width + i] if evenly else 0.0
                if block.curved[i]:
                    own, done = theta[block.row[i]], block.done[i] + step
                    hold_measured_laws(own, p, i, width, done, pushed, held_dry)
                else:
                    hold_no_curves(p, i, width, pushed, held_dry)
    if measured is not None and len(measured) > 1:
        hold_hysteresis(block, counts, p, width)


@compile_inner
def _react(lanes, laws, measured, block, counts, p):
    """Let every lane remember what its last step did to path, drive and strains."""
    width = len(lanes)
    if laws is not None and len(laws) > 1:
        for i in range(width):
            follow_path(PATH, p[X * width + i] - p[X_BEFORE * width + i], p, i, width)
    if laws is not None and len(laws) > 3:
        for i in range(width):
            react_to_motion(p, i, width, block.constants[0, i])
    if measured is not None and len(measured) > 1:
        follow_block_strains(block, counts, p, width)


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
    starts,
    path_memory,
    theta,
    set_of,
    h,
    sub,
    out,
):
    """Integrate lanes side by side from their start states; fill out with the true states.

    lanes: a tuple whose length is the block's width (a constant for the compiler).
    laws: by its type, which laws are compiled in (see `motion.py`).
    dry: whether dry friction (or a hold) is on in any lane.
    measured: by its type, which measured laws of theta act: None for none, a tuple of one for
        curves and the clock's pace, of two for hysteresis as well.
    drives: (rows, steps) the command after command and drive, before the gain.
    drive_of: (lanes,) row of drives of each lane.
    begin: (lanes,) step of that row at which each lane starts.
    first_step: (lanes,) substeps since the recording began, at each lane's start.
    starts: (lanes, 4) x, th, v, w.
    path_memory: (lanes, PATH_SIZE) what the lanes remember of their paths at the start;
        afterwards at the end.
    theta: (sets, SIZE) the twins.
    set_of: (lanes,) row of theta of each lane.
    h: s by the stamps, a substep; sub: substeps a sample.
    out: (lanes, samples, 4); the first sample is the start state.
    """
    width = len(lanes)
    count, samples = out.shape[0], out.shape[1]
    p = np.empty(ROWS * width)
    remembers = measured is not None and len(measured) > 1
    block = make_block(width, remembers)
    counts = 0, 0
    for first in range(0, count, width):
        paced = _place_block(
            first, measured, block, begin, first_step, starts, path_memory, theta, set_of, h, p
        )
        if remembers:
            counts = list_elements(block.elements, block.listed)
        for n in range(samples):
            for i in range(min(width, count - first)):
                for k in range(4):
                    out[first + i, n, k] = p[(X + k) * width + i]
            for step in range(n * sub, (n + 1) * sub if n < samples - 1 else n * sub):
                if paced:
                    _hold_paces(lanes, block, step, theta, p)
                _drive_lanes(lanes, drives, drive_of, block, step, p)
                _hold(lanes, laws, measured, block, counts, step, theta, p)
                _advance(lanes, laws, dry, p)
                _react(lanes, laws, measured, block, counts, p)
        _keep_paths(first, count, measured, block, path_memory, p, width)
