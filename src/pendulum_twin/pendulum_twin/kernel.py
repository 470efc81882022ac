"""Run the compiled passes; the only place where time advances.

`filter_command` runs command and drive once over a stretch and gives the force before the gain;
`integrate_lanes` integrates the motion, many lanes side by side (`motion.py`, `stages.py`,
`stick_slip.py`);
the sensor's effects turn true states into measured states (`sensors.py`). A lane is a run. Lanes
are packed in blocks of constant width (`block.py`); a lane gives the same bits in any width, for
nothing here depends on its neighbours.
"""

from __future__ import annotations

import numpy as np

from pendulum_twin import compose, compose_rows
from pendulum_twin.block import (
    AT,
    AT_REST,
    CART_DRY,
    CART_WAY,
    COSTLY,
    CURVED,
    DONE,
    ENDED,
    FORCE,
    LANE,
    POLE_WAY,
    PUSHED,
    ROW,
    ROWS,
    X_BEFORE,
    H,
    V,
    W,
    X,
    get_four,
    put_four,
)
from pendulum_twin.equations import compile_apart, compile_inner
from pendulum_twin.held_laws import (
    hold_effects,
    hold_hysteresis,
    hold_measured_laws,
    hold_no_curves,
    hold_pace,
    remember_step,
    strain_elements,
)
from pendulum_twin.hysteresis import make_elements
from pendulum_twin.law_curves import bend_commands
from pendulum_twin.machine_code import compile_cached
from pendulum_twin.motion import MOVING, advance_step
from pendulum_twin.parameter_vector import FORCE_PER_PWM
from pendulum_twin.placing import keep_paths, place_block, switch_effects
from pendulum_twin.stages import advance_by_stages, ask_costly_laws, get_applied
from pendulum_twin.stick_slip import compute_margins, cut_step, find_modes, get_sign

WIDTH = 16
LONGEST_STEP_S = 1e-3

apply_command_filters = compose.compose_filters(of_command=True)
apply_drive_filters = compose.compose_filters(of_command=False)
is_frozen = compose.compose_holds()
acts_evenly = compose_rows.compose_question(compose.HELD)


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


@compile_apart
def _advance(lanes, laws, dry, p):
    """Advance every lane of a block by one step."""
    if laws is None:
        _advance_in_loop(lanes, laws, p)
    else:
        if len(laws) > 1:
            ask_costly_laws(X, COSTLY, 1.0, p, len(lanes))
        resting = dry and _begin_step(lanes, laws, p)
        if len(laws) > 1:
            advance_by_stages(laws, p, len(lanes))
        else:
            _advance_in_loop(lanes, laws, p)
        if dry:
            _end_step(lanes, laws, p, resting)


@compile_inner
def _advance_in_loop(lanes, laws, p):
    """Advance every lane by one step in which its modes hold."""
    width = len(lanes)
    for i in range(width):
        state, applied = get_four(p, X, i, width), get_four(p, FORCE, i, width)
        modes = get_four(p, CART_WAY, i, width) if laws is not None else MOVING
        after = advance_step(state, applied, modes, p, i, width, laws, p[H * width + i])
        put_four(p, X, i, width, after)


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
            state, applied = get_four(p, X, i, width), get_applied(COSTLY, p, i, width, laws)
            put_four(p, CART_WAY, i, width, find_modes(state, applied, p, i, width, laws))
    return at_rest > 0


@compile_inner
def _end_step(lanes, laws, p, resting):
    """Cut the steps in which a mode ended; put back the states that stand still."""
    width = len(lanes)
    ends = 0
    if resting:
        if len(laws) > 1:
            ask_costly_laws(X, COSTLY, 1.0, p, width)
            ask_costly_laws(X, AT_REST, 0.0, p, width)
        for i in range(width):
            state, modes = get_four(p, X, i, width), get_four(p, CART_WAY, i, width)
            applied = get_applied(COSTLY, p, i, width, laws)
            at_rest = get_applied(AT_REST, p, i, width, laws)
            cart_margin, pole_margin = compute_margins(
                state, applied, at_rest, modes, p, i, width, laws
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
                applied, h = get_applied(COSTLY, p, i, width, laws), p[H * width + i]
                put_four(
                    p, X, i, width, cut_step(state, after, applied, modes, p, i, width, laws, h)
                )
    for i in range(width):
        x, th, v, w = get_four(p, X_BEFORE, i, width)
        stands = is_frozen(p[FORCE * width + i], v, w, p, i, width)
        after = get_four(p, X, i, width)
        put_four(p, X, i, width, (x, th, v, w) if stands else after)


@compile_inner
def _show_states(lanes, first, n, p, out):
    """Fill sample n of out with the states of the block's lanes, the first lane and on."""
    width = len(lanes)
    for i in range(min(width, len(out) - first)):
        for k in range(4):
            out[first + i, n, k] = p[(X + k) * width + i]


@compile_inner
def _hold_paces(lanes, places, step, theta, p):
    """Set each lane's step, s, by its clock's measured pace; step: substeps since the starts."""
    width = len(lanes)
    for i in range(width):
        hold_pace(theta[places[ROW, i]], p, i, width, places[DONE, i] + step)


@compile_inner
def _drive_lanes(lanes, drives, drive_of, places, step, p):
    """Set the drive's force on every lane over the next step; the arguments of `integrate_lanes`.

    step: substeps since the lanes' starts.
    """
    width = len(lanes)
    for i in range(width):
        drive = drives[drive_of[places[LANE, i]], places[AT, i] + step]
        p[FORCE * width + i] = drive * p[FORCE_PER_PWM * width + i]


@compile_inner
def _hold_curves(lanes, evenly, curved, places, step, theta, p):
    """Add what measured curves of every lane do evenly over the next step.

    evenly: whether `hold_effects` set what effects do.
    curved: whether any lane has measured curves.
    step: substeps since the lanes' starts.
    """
    width = len(lanes)
    if not curved:  # lanes without curves are computed side by side
        for i in range(width):
            pushed = p[PUSHED * width + i] if evenly else 0.0
            hold_no_curves(p, i, width, pushed, p[CART_DRY * width + i] if evenly else 0.0)
    else:
        for i in range(width):
            pushed = p[PUSHED * width + i] if evenly else 0.0
            held_dry = p[CART_DRY * width + i] if evenly else 0.0
            if p[CURVED * width + i] > 0.0:
                own, done = theta[places[ROW, i]], places[DONE, i] + step
                hold_measured_laws(own, p, i, width, done, pushed, held_dry)
            else:
                hold_no_curves(p, i, width, pushed, held_dry)


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
    p, places = np.empty(ROWS * width), np.empty((4, width), dtype=np.int64)
    evenly = False
    remembers = measured is not None and len(measured) > 1
    elements, listed, moves, loads = make_elements(width, remembers)
    for first in range(0, count, width):
        curved, paced, counts = place_block(
            first, measured, begin, first_step, starts, path_memory, theta, set_of, h, places,
            elements, listed, p,
        )  # fmt: skip
        if laws is not None and len(laws) > 1:
            switch_effects(places, theta, p, width)
            evenly = acts_evenly(p, width)
        for n in range(samples):
            _show_states(lanes, first, n, p, out)
            for step in range(n * sub, (n + 1) * sub if n < samples - 1 else n * sub):
                if paced:
                    _hold_paces(lanes, places, step, theta, p)
                _drive_lanes(lanes, drives, drive_of, places, step, p)
                if laws is not None and len(laws) > 1 and evenly:
                    hold_effects(places, step, p, width)
                if measured is not None:
                    _hold_curves(lanes, evenly, curved, places, step, theta, p)
                if remembers:
                    hold_hysteresis(elements, listed, counts, moves, loads, p, width)
                _advance(lanes, laws, dry, p)
                if laws is not None and len(laws) > 1 and evenly:
                    remember_step(p, width)
                if remembers:
                    strain_elements(elements, listed, counts, moves, p, width)
        keep_paths(first, count, measured, elements, path_memory, p, width)
