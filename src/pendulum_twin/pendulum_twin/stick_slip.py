"""Apply rigid dry friction: over a step every joint either slips in one direction or sticks.

A joint at rest sticks while its dry friction can hold what pushes it, the push through the
coupling included. A mode ends where its margin passes zero: the velocity of a slipping joint, the
friction in reserve of a sticking joint. A step in which a mode ends is cut there, the modes are
found anew, and the remainder of the step is done in the new modes. `motion` explains the
arguments. What is applied to `find_modes` and `compute_margins` is that at their state; functions
of a cut step ask costly laws themselves.
"""

from __future__ import annotations

from pendulum_twin.equations import compile_apart, compile_inner
from pendulum_twin.motion import (
    advance_step,
    apply_costly_laws,
    compute_cart_level,
    compute_pole_level,
    sum_forces,
)
from pendulum_twin.parameter_vector import INERTIA, MASS

LASTING = 1.0  # the margin of a joint without dry friction: its mode never ends
# Secant steps towards the end of a mode: its time is then known to some 1e-12 of a step.
SEARCHES = 4
# The cut lies so much of a step behind the end of a mode, so that the mode surely has ended.
BEYOND = 1e-9


@compile_inner
def get_sign(number):
    """Return 1, 0 or -1."""
    return (1.0 if number > 0.0 else 0.0) - (1.0 if number < 0.0 else 0.0)


@compile_inner
def find_modes(state, applied, p, i, width, laws):
    """Return the modes; a joint at rest slips when the push exceeds its dry friction."""
    x, th, v, w = state
    mass, inertia = p[MASS * width + i], p[INERTIA * width + i]
    push, turn, coupling = sum_forces(state, applied, p, i, width, laws)
    cart_way, pole_way = get_sign(v), get_sign(w)
    push -= cart_way * compute_cart_level(abs(v), x, cart_way, applied, p, i, width)
    turn -= pole_way * compute_pole_level(abs(w), th, pole_way, applied, p, i, width)
    cart_runs, pole_runs = v != 0.0, w != 0.0

    # The pole, with the cart standing still; then the cart, with the pole's motion; then the pole,
    # with the cart's.
    level = 0.0 if pole_runs else compute_pole_level(0.0, th, get_sign(turn), applied, p, i, width)
    pole_moves = pole_runs | does_slip(turn, level)
    pushed = push + (coupling * (turn - get_sign(turn) * level) / inertia if pole_moves else 0.0)
    level = (
        0.0 if cart_runs else compute_cart_level(0.0, x, get_sign(pushed), applied, p, i, width)
    )
    cart_moves = cart_runs | does_slip(pushed, level)
    turned = turn + (coupling * (push - get_sign(pushed) * level) / mass if cart_moves else 0.0)
    level = (
        0.0 if pole_runs else compute_pole_level(0.0, th, get_sign(turned), applied, p, i, width)
    )
    pole_moves = pole_runs | does_slip(turned, level)

    cart_free, pole_free = 1.0 if cart_moves else 0.0, 1.0 if pole_moves else 0.0
    cart_way = cart_way if cart_runs else cart_free * get_sign(pushed)
    pole_way = pole_way if pole_runs else pole_free * get_sign(turned)
    return cart_way, pole_way, cart_free, pole_free


@compile_inner
def does_slip(push, level):
    """Return whether a joint at rest gives way to a push (N or N m) against a level."""
    return (level <= 0.0) | (abs(push) > level)


@compile_inner
def compute_margins(state, applied, at_rest, modes, p, i, width, laws):
    """Return the margins of the modes of cart and pole; a mode with a margin below 0 has ended.

    at_rest: what is applied where both joints stand.
    """
    x, th, v, w = state
    cart_way, pole_way, cart_free, pole_free = modes
    push, turn, coupling = sum_forces(state, applied, p, i, width, laws)
    push -= cart_way * compute_cart_level(abs(v), x, cart_way, applied, p, i, width)
    turn -= pole_way * compute_pole_level(abs(w), th, pole_way, applied, p, i, width)
    pushed = push + coupling * pole_free * turn / p[INERTIA * width + i]
    turned = turn + coupling * cart_free * push / p[MASS * width + i]
    cart_reserve = compute_cart_level(0.0, x, get_sign(pushed), at_rest, p, i, width) - abs(pushed)
    pole_reserve = compute_pole_level(0.0, th, get_sign(turned), at_rest, p, i, width) - abs(
        turned
    )
    cart_runs = (
        v * cart_way
        if compute_cart_level(0.0, x, cart_way, at_rest, p, i, width) > 0.0
        else LASTING
    )
    pole_runs = (
        w * pole_way
        if compute_pole_level(0.0, th, pole_way, at_rest, p, i, width) > 0.0
        else LASTING
    )
    return (
        cart_runs if cart_free > 0.0 else cart_reserve,
        pole_runs if pole_free > 0.0 else pole_reserve,
    )


@compile_inner
def _ask_margins(state, applied, modes, p, i, width, laws):
    """Return the margins with what costly laws add at this state and at rest."""
    x, th, _, _ = state
    there = apply_costly_laws(state, applied, p, i, width)
    at_rest = apply_costly_laws((x, th, 0.0, 0.0), applied, p, i, width)
    return compute_margins(state, there, at_rest, modes, p, i, width, laws)


@compile_apart
def cut_step(state, after, applied, modes, p, i, width, laws, h):
    """Return the state after a step from state that would end in after with its modes held."""
    cart_begin, pole_begin = _ask_margins(state, applied, modes, p, i, width, laws)
    cart_end, pole_end = _ask_margins(after, applied, modes, p, i, width, laws)
    # The share of the step after which each mode ends; above 1 when it lasts.
    cart_share = cart_begin / (cart_begin - cart_end) if cart_begin >= 0.0 > cart_end else 2.0
    pole_share = pole_begin / (pole_begin - pole_end) if pole_begin >= 0.0 > pole_end else 2.0
    if cart_share > 1.0 and pole_share > 1.0:
        return after
    of_cart = cart_share <= pole_share
    begin, end = (cart_begin, cart_end) if of_cart else (pole_begin, pole_end)
    share, (x, th, v, w) = find_mode_end(
        state, after, applied, modes, of_cart, begin, end, p, i, width, laws, h
    )
    # A joint that slipped stands now; one that stuck has not moved.
    v, w = (0.0, w) if of_cart else (v, 0.0)
    modes = find_modes(
        (x, th, v, w), apply_costly_laws((x, th, v, w), applied, p, i, width), p, i, width, laws
    )
    x, th, v, w = advance_step((x, th, v, w), applied, modes, p, i, width, laws, (1.0 - share) * h)
    # A second end inside one step is at rest; the next step finds the modes anew.
    at_rest = apply_costly_laws((x, th, 0.0, 0.0), applied, p, i, width)
    cart_level = compute_cart_level(0.0, x, modes[0], at_rest, p, i, width)
    pole_level = compute_pole_level(0.0, th, modes[1], at_rest, p, i, width)
    v = 0.0 if v * modes[0] < 0.0 and cart_level > 0.0 else v
    w = 0.0 if w * modes[1] < 0.0 and pole_level > 0.0 else w
    return x, th, v, w


@compile_apart
def find_mode_end(state, after, applied, modes, of_cart, begin, end, p, i, width, laws, h):
    """Return the share of the step after which a mode has just ended, and the state there.

    of_cart: whether it is the cart's mode, else the pole's.
    begin, end: margins at the begin of the step, at least 0, and at its end, below 0.

    Regula falsi with the Illinois rule.
    """
    low, high, ended, last = 0.0, 1.0, after, 0.0
    for _ in range(SEARCHES):
        share = min(low + (high - low) * begin / (begin - end) + BEYOND, high)
        there = advance_step(state, applied, modes, p, i, width, laws, share * h)
        cart_margin, pole_margin = _ask_margins(there, applied, modes, p, i, width, laws)
        margin = cart_margin if of_cart else pole_margin
        if margin < 0.0:
            high, ended, end = share, there, margin
            begin *= 0.5 if last < 0.0 else 1.0
        else:
            low, begin = share, margin
            end *= 0.5 if last > 0.0 else 1.0
        last = -1.0 if margin < 0.0 else 1.0
    return high, ended
