"""Move a lane over a step in which its modes hold, by Runge-Kutta of fourth order.

A lane is a run: a parameter vector theta and a start state. Lanes are packed in blocks whose
numbers lie row by row: number k of lane i is `p[k * width + i]`, so that the compiler computes
neighbouring lanes side by side.

Arguments that the functions of `motion` and `stick_slip` share:
state: x (m), th (rad), v (m/s), w (rad/s).
applied: what acts on the joints evenly over the step: force on the cart, N (the drive's and that
    of measured laws); torque on the pole, N m; and what measured laws add to the dry friction of
    the cart, N, and of the pole, N m. Where costly laws are compiled in, four numbers follow that
    these laws add at the state: force, torque, and dry friction of the cart and of the pole.
modes: cart_way, pole_way, cart_free, pole_free. A way is the direction in which the joint slips,
    1, -1 or 0; free is 0 for a joint that sticks and 1 for a joint that moves.
p, i, width: the block, the lane in it, and how many lanes it has.
laws: says by its type which laws are compiled in: None for none, a tuple of one for those of plain
    arithmetic, of two for all. A law that is compiled in and neutral adds exactly nothing.
h: s, the step.
"""

from __future__ import annotations

from pendulum_twin import compose, compose_reactions, compose_rows
from pendulum_twin.effects.effect import Place
from pendulum_twin.equations import (
    compile_inner,
    compute_cart_load,
    compute_pole_weight,
    sin_cos,
    solve_accelerations,
)
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    GRAVITY,
    INERTIA,
    MASS,
    MOMENT,
    POLE_VISCOUS,
)

NO_LAWS, PLAIN_LAWS, ALL_LAWS = None, (0,), (0, 0)
CURVES, HYSTERESIS = (0,), (0, 0)  # measured laws; see `kernel.integrate_lanes`
LAW_SETS = (NO_LAWS, PLAIN_LAWS, ALL_LAWS)
MOVING = (0.0, 0.0, 1.0, 1.0)  # modes without dry friction

add_cart_forces = compose.compose_forces(Place.CART)
add_pole_torques = compose.compose_forces(Place.POLE)
sum_costly_laws = compose_rows.compose_costly_sums()
sum_held_effects = compose.compose_held()
bend_drive = compose.compose_drive_laws()
sum_loads = compose.compose_loads()
sum_path_forces = compose.compose_path_forces()
follow_path = compose.compose_path_following()
sum_shares = compose_reactions.compose_shares()
sum_pulls = compose_reactions.compose_pulls()
react_to_push = compose_reactions.compose_reactions()
_sum_cart_levels = compose.compose_dry_level(Place.CART)
_sum_pole_levels = compose.compose_dry_level(Place.POLE)


@compile_inner
def apply_costly_laws(state, applied, p, i, width):
    """Return what is applied at a state; costly laws are asked where they are compiled in."""
    if len(applied) > 4:
        x, th, v, w = state
        return applied[:4] + sum_costly_laws(x, th, v, w, p, i, width)
    return applied


@compile_inner
def compute_cart_level(speed, x, way, applied, p, i, width):
    """Return the level of the cart's dry friction, N, at a speed, place and direction.

    applied: at this speed and place.
    """
    return max(_sum_cart_levels(speed, x, way, applied, p, i, width) + applied[2], 0.0)


@compile_inner
def compute_pole_level(speed, th, way, applied, p, i, width):
    """Return the level of the pole's dry friction, N m, at a speed, angle and direction.

    applied: at this speed and angle.
    """
    return max(_sum_pole_levels(speed, th, way, applied, p, i, width) + applied[3], 0.0)


@compile_inner
def sum_forces(state, applied, p, i, width, laws):
    """Return force (N), torque (N m), both without dry friction, and S cos(th)."""
    x, th, v, w = state
    sine, cosine = sin_cos(th)
    coupling = p[COUPLING * width + i]
    push = applied[0] + compute_cart_load(coupling, w, sine) - p[CART_VISCOUS * width + i] * v
    turn = (
        compute_pole_weight(p[MOMENT * width + i], p[GRAVITY * width + i], sine)
        - p[POLE_VISCOUS * width + i] * w
        + applied[1]
    )
    if laws is not None:
        push += add_cart_forces(x, v, th, w, applied, p, i, width)
        turn += add_pole_torques(x, v, th, w, applied, p, i, width)
    return push, turn, coupling * cosine


@compile_inner
def compute_accelerations(state, applied, modes, p, i, width, laws):
    """Return v' (m/s^2) and w' (rad/s^2)."""
    x, th, v, w = state
    cart_way, pole_way, cart_free, pole_free = modes
    push, turn, coupling = sum_forces(state, applied, p, i, width, laws)
    if laws is not None:
        push -= cart_way * compute_cart_level(abs(v), x, cart_way, applied, p, i, width)
        turn -= pole_way * compute_pole_level(abs(w), th, pole_way, applied, p, i, width)
    return solve_accelerations(
        p[MASS * width + i], coupling, p[INERTIA * width + i], push, turn, cart_free, pole_free
    )


@compile_inner
def _ask_accelerations(state, applied, modes, p, i, width, laws):
    """Return v' and w' with what costly laws add at this state."""
    there = apply_costly_laws(state, applied, p, i, width)
    return compute_accelerations(state, there, modes, p, i, width, laws)


@compile_inner
def advance_step(state, applied, modes, p, i, width, laws, h):
    """Return the state a step later, the modes being held."""
    x, th, v, w = state
    half = 0.5 * h
    a1, b1 = _ask_accelerations(state, applied, modes, p, i, width, laws)
    v2, w2 = v + half * a1, w + half * b1
    a2, b2 = _ask_accelerations(
        (x + half * v, th + half * w, v2, w2), applied, modes, p, i, width, laws
    )
    v3, w3 = v + half * a2, w + half * b2
    a3, b3 = _ask_accelerations(
        (x + half * v2, th + half * w2, v3, w3), applied, modes, p, i, width, laws
    )
    v4, w4 = v + h * a3, w + h * b3
    a4, b4 = _ask_accelerations(
        (x + h * v3, th + h * w3, v4, w4), applied, modes, p, i, width, laws
    )
    speeds, rates = ((v2, w2), (v3, w3), (v4, w4)), ((a1, b1), (a2, b2), (a3, b3), (a4, b4))
    return end_step(state, speeds, rates, h)


@compile_inner
def end_step(state, speeds, rates, h):
    """Return the state a step later.

    speeds: of cart and pole in the second, third and fourth stage; rates: accelerations in all.
    """
    x, th, v, w = state
    (v2, w2), (v3, w3), (v4, w4) = speeds
    (a1, b1), (a2, b2), (a3, b3), (a4, b4) = rates
    sixth = h / 6.0
    return (
        x + sixth * (v + 2.0 * (v2 + v3) + v4),
        th + sixth * (w + 2.0 * (w2 + w3) + w4),
        v + sixth * (a1 + 2.0 * (a2 + a3) + a4),
        w + sixth * (b1 + 2.0 * (b2 + b3) + b4),
    )
