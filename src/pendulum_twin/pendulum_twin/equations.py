"""State the equations of motion once, with the conserved energy (thesis, equations 18-23).

State: cart position x (m), pole angle th (rad, 0 upright, counterclockwise positive), cart
velocity v, pole rate w. With S the first moment of all that moves, m its mass, Jp the pole's
inertia about its axis:

    m  v' = S cos(th) w' - S w^2 sin(th) + cart_force
    Jp w' = S cos(th) v' + S g sin(th) + pole_torque
"""

from __future__ import annotations

import numba
import numpy as np

from pendulum_twin import elementary

# The compiler puts the function into its caller whatever its length: only then are lanes computed
# side by side. No fastmath anywhere: a lane gives the same bits whatever lanes are beside it.
compile_inline = numba.njit(error_model="numpy", forceinline=True)
# The same for functions that only compiled code calls: they take half as long to compile.
compile_inner = numba.njit(
    error_model="numpy", forceinline=True, no_cpython_wrapper=True, no_cfunc_wrapper=True
)
# For functions that no loop over lanes calls.
compile_apart = numba.njit(error_model="numpy", no_cpython_wrapper=True, no_cfunc_wrapper=True)

sin_cos = compile_inline(elementary.sin_cos)
sin_cos_of_array = compile_inline(elementary.sin_cos_of_array)
exp = compile_inline(elementary.exp)


@compile_inner
def compute_cart_load(coupling, w, sine):
    """Return the pole's centrifugal force on the cart, N."""
    return -coupling * w * w * sine


@compile_inner
def compute_pole_weight(moment, gravity, sine):
    """Return gravity's torque on the pole, N m."""
    return moment * gravity * sine


@compile_inner
def solve_accelerations(mass, coupling_cosine, inertia, force, torque, cart_free, pole_free):
    """Return v' and w' from force and torque without the coupling's.

    cart_free, pole_free: 0 for a joint that sticks, else 1.
    """
    both = coupling_cosine * cart_free * pole_free
    inverse = 1.0 / (mass * inertia - both * both)
    return (
        cart_free * (inertia * force + both * torque) * inverse,
        pole_free * (mass * torque + both * force) * inverse,
    )


def compute_energy(mass, coupling, moment, inertia, gravity, state):
    """Return the mechanical energy, J, of states (4, ...); zero at rest with the pole level.

    The cross term of the kinetic energy has the coupling's sign in the equations: -S cos(th) v w.
    """
    _, th, v, w = state
    return (
        0.5 * mass * v * v
        + 0.5 * inertia * w * w
        - coupling * np.cos(th) * v * w
        + moment * gravity * np.cos(th)
    )
