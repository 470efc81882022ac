"""Set what acts evenly over a step of a lane, and let the lane remember what the step did.

Arguments that the functions share:
p, i, width: the block, the lane in it, and how many lanes it has (`block.py`).
"""

from __future__ import annotations

from pendulum_twin import compose, compose_rows
from pendulum_twin.block import (
    CART_DRY,
    DONE,
    EVEN,
    EVEN_H,
    FORCE,
    FREED,
    LOAD,
    MIDDLE,
    OWN_MASS,
    OWN_VISCOUS,
    POLE_DRY,
    PUSH,
    PUSHED,
    REACTION,
    TH,
    TH_BEFORE,
    TIME,
    TORQUE,
    V_BEFORE,
    X_BEFORE,
    H,
    V,
    W,
    X,
    get_four,
    put_four,
)
from pendulum_twin.equations import compile_inner
from pendulum_twin.hysteresis import follow_strains, sum_hysteresis
from pendulum_twin.law_curves import follow_pace, sum_measured_laws
from pendulum_twin.motion import (
    react_to_push,
    sum_pulls,
    sum_shares,
)
from pendulum_twin.parameter_vector import CART_VISCOUS, MASS

add_loads = compose_rows.compose_load_rows()
add_held_effects = compose_rows.compose_held_rows()
add_path_forces = compose_rows.compose_path_rows()
follow_paths = compose_rows.compose_path_following()
bend_drives = compose_rows.compose_drive_rows()
reacts = compose_rows.compose_question(compose.REACTING_AT)


@compile_inner
def hold_pace(theta, p, i, width, step):
    """Set how long the next step of lane i is, by the clock's measured law in its middle.

    step: substeps since the recording began.
    """
    even = p[EVEN_H * width + i]
    p[H * width + i] = even * follow_pace(theta, (step + 0.5) * even)


@compile_inner
def hold_effects(places, step, p, width):
    """Set what effects of every lane do evenly over its next step, in the middle of the step.

    places: see `block`; step: substeps since the lanes' starts.
    """
    _begin_holding(places, step, p, width)
    add_loads(p, width)
    for i in range(width):
        p[MASS * width + i] = p[OWN_MASS * width + i] + p[LOAD * width + i]
    add_held_effects(p, width)
    add_path_forces(p, width)
    for i in range(width):
        p[FORCE * width + i] *= p[EVEN * width + i]
    bend_drives(p, width)
    if reacts(p, width):
        _share_drive(p, width)
    for i in range(width):
        _, force, dry, drag = get_four(p, EVEN, i, width)
        p[FORCE * width + i] += force
        p[PUSHED * width + i], p[CART_DRY * width + i] = force, dry
        p[CART_VISCOUS * width + i] = p[OWN_VISCOUS * width + i] + drag + p[FREED * width + i]
        p[X_BEFORE * width + i] = p[X * width + i]


@compile_inner
def _begin_holding(places, step, p, width):
    """Set where every lane is in the middle of its next step, and that nothing acts there yet."""
    for i in range(width):
        h = p[H * width + i]
        x, th, v, w = get_four(p, X, i, width)
        p[TIME * width + i] = (places[DONE, i] + step + 0.5) * p[EVEN_H * width + i]
        put_four(p, MIDDLE, i, width, (x + 0.5 * h * v, th + 0.5 * h * w, v, w))
        put_four(p, EVEN, i, width, (1.0, 0.0, 0.0, 0.0))
        p[LOAD * width + i] = p[FREED * width + i] = 0.0
        # the last step's stand there
        p[MASS * width + i] = p[OWN_MASS * width + i]
        p[CART_VISCOUS * width + i] = p[OWN_VISCOUS * width + i]


@compile_inner
def _share_drive(p, width):
    """Take the drive's own mass off every lane's cart: what joins the two pulls at the cart."""
    for i in range(width):
        share = sum_shares(p, i, width)
        p[MASS * width + i] -= share * p[OWN_MASS * width + i]
        p[FORCE * width + i] *= 1.0 - share
        p[(EVEN + 1) * width + i] -= sum_pulls(REACTION, p, i, width)
        p[V_BEFORE * width + i] = p[V * width + i]


@compile_inner
def remember_step(p, width):
    """Let every lane remember what its last step did to path and drive."""
    follow_paths(p, width)
    if reacts(p, width):
        _react_to_step(p, width)


@compile_inner
def _react_to_step(p, width):
    """Let every lane's cart act back on the drive; what acts on it shows in its velocity.

    In two loops: the compiler cannot prove that a single loop's lanes are apart.
    """
    for i in range(width):
        drive = p[FORCE * width + i] - p[PUSHED * width + i] - sum_pulls(REACTION, p, i, width)
        change = p[V * width + i] - p[V_BEFORE * width + i]
        mass = (1.0 - sum_shares(p, i, width)) * p[OWN_MASS * width + i]
        p[PUSH * width + i] = mass * change / p[H * width + i] - drive
    for i in range(width):
        react_to_push(REACTION, p[PUSH * width + i], p[H * width + i], p, i, width)


@compile_inner
def hold_measured_laws(theta, p, i, width, step, pushed, held_dry):
    """Add the measured laws of lane i to what acts evenly over its next step.

    step: substeps since the recording began.
    pushed: N; what effects add to the drive's force over the step.
    held_dry: N; what effects add to the cart's dry friction over the step.

    The laws are taken in the middle of the step as its first velocities lead there: of second
    order in the step, and a force along the rail keeps the energy.
    """
    x, th, v, w = get_four(p, X, i, width)
    h, t = p[H * width + i], (step + 0.5) * p[EVEN_H * width + i]
    gain, force, torque, cart_dry, pole_dry = sum_measured_laws(
        theta, x + 0.5 * h * v, v, th + 0.5 * h * w, w, t, h
    )
    drive = p[FORCE * width + i] - pushed
    applied = drive * gain + pushed + force, torque, held_dry + cart_dry, pole_dry
    put_four(p, FORCE, i, width, applied)
    p[PUSHED * width + i] = pushed + force


@compile_inner
def hold_no_curves(p, i, width, pushed, held_dry):
    """Set what `hold_measured_laws` sets for a twin without curves."""
    p[TORQUE * width + i] = p[POLE_DRY * width + i] = 0.0
    p[CART_DRY * width + i], p[PUSHED * width + i] = held_dry, pushed


@compile_inner
def hold_hysteresis(elements, listed, counts, moves, loads, p, width):
    """Add the measured hysteresis of every lane to what acts evenly over its next step.

    The arguments but p and width: see `hysteresis`; as at the step's begin.
    """
    for i in range(width):
        half = 0.5 * p[H * width + i]
        moves[0, i], moves[1, i] = half * p[V * width + i], half * p[W * width + i]
    sum_hysteresis(elements, listed, counts, moves, loads)
    for i in range(width):
        p[FORCE * width + i] += loads[0, i]
        p[PUSHED * width + i] += loads[0, i]
        p[TORQUE * width + i] += loads[1, i]
        p[X_BEFORE * width + i], p[TH_BEFORE * width + i] = p[X * width + i], p[TH * width + i]


@compile_inner
def strain_elements(elements, listed, counts, moves, p, width):
    """Strain the elements of measured hysteresis of every lane by its last step."""
    for i in range(width):
        moves[0, i] = p[X * width + i] - p[X_BEFORE * width + i]
        moves[1, i] = p[TH * width + i] - p[TH_BEFORE * width + i]
    follow_strains(elements, listed, counts, moves)
