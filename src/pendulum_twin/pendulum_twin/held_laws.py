"""Set what acts evenly over a step of a lane, and let the lane remember what the step did.

Arguments that the functions share:
p, i, width: the block, the lane in it, and how many lanes it has (`block.py`).
"""

from __future__ import annotations

from pendulum_twin.block import (
    CART_DRY,
    EVEN_H,
    FORCE,
    PATH,
    POLE_DRY,
    PUSHED,
    REACTION,
    TH,
    TH_BEFORE,
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
    bend_drive,
    react_to_push,
    sum_held_effects,
    sum_loads,
    sum_path_forces,
    sum_pulls,
    sum_shares,
)
from pendulum_twin.parameter_vector import CART_VISCOUS, MASS


@compile_inner
def hold_pace(theta, p, i, width, step):
    """Set how long the next step of lane i is, by the clock's measured law in its middle.

    step: substeps since the recording began.
    """
    even = p[EVEN_H * width + i]
    p[H * width + i] = even * follow_pace(theta, (step + 0.5) * even)


@compile_inner
def hold_effects(p, i, width, laws, step, mass, viscous):
    """Set what effects of lane i do evenly over its next step, in the middle of the step.

    laws: see `motion.py`.
    step: substeps since the recording began.
    mass: kg; what moves along the rail without effects.
    viscous: N s/m; the cart's viscous friction without effects.
    """
    h = p[H * width + i]
    t = (step + 0.5) * p[EVEN_H * width + i]
    p[MASS * width + i] = mass
    p[MASS * width + i] = mass + sum_loads(t, h, p, i, width)
    x, th, v, w = get_four(p, X, i, width)
    half_way = 0.5 * h * v
    x, th = x + half_way, th + 0.5 * h * w
    gain, force, dry, drag = sum_held_effects(x, th, w, t, p, i, width)
    force += sum_path_forces(PATH, half_way, p, i, width)
    p[CART_VISCOUS * width + i] = viscous  # the last step's stands there
    drive, freed = bend_drive(p[FORCE * width + i] * gain, v, p, i, width)
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
    p[CART_VISCOUS * width + i] = viscous + drag + freed


@compile_inner
def react_to_motion(p, i, width, mass):
    """Let lane i's cart act back on the drive; what acts on it shows in its change of velocity.

    mass: kg; what moves along the rail without effects.
    """
    h = p[H * width + i]
    drive = p[FORCE * width + i] - p[PUSHED * width + i] - sum_pulls(REACTION, p, i, width)
    change = p[V * width + i] - p[V_BEFORE * width + i]
    push = (1.0 - sum_shares(p, i, width)) * mass * change / h - drive
    react_to_push(REACTION, push, h, p, i, width)


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
