"""Evaluate the measured hysteresis of a parameter vector: elements that strain, then slip.

Each knot of such a law is a spring in series with dry friction. It strains with its joint until it
has gone the knot's way, then slips, and holds back with the value at the knot (W. D. Iwan, J.
Applied Mechanics 33 (1966) 893; its element is the stop operator of M. Brokate and J. Sprekels,
Hysteresis and Phase Transitions (1996), section 2.1). Most elements of a fitted law have no
friction, so a lane lists the others before it runs. Arguments:
theta: (SIZE,) of one lane.
elements: (3, STRAINS) of the lane: way until it slips, m or rad; stiffness, N/m or N m/rad; what
    it is strained by, m or rad.
slots: (STRAINS,) of each element's strain in `strains`.
counts: how many elements the cart has, and how many cart and pole have; the cart's come first.
strains: (STRAINS,) what is kept between runs: the strains of the cart, m, then of the pole, rad;
    0 for an element without friction.
move, turn: m, rad; of cart and pole since the strains were taken.
"""

from __future__ import annotations

from pendulum_twin.equations import compile_inner
from pendulum_twin.law_curves import ROLES
from pendulum_twin.laws.kind import Role
from pendulum_twin.laws.law import MOST_KNOTS
from pendulum_twin.parameter_vector import (
    FIRST,
    KIND,
    KNOTS,
    LAW_SIZE,
    LAWS,
    SIZE,
    SPACING,
    VALUES,
)

STRAINS = 2 * MOST_KNOTS
POLE_STRAINS = MOST_KNOTS  # where those of the pole begin
WAY, STIFFNESS, STRAIN = range(3)  # rows of `elements`
CART, POLE = int(Role.CART_HYSTERESIS), int(Role.POLE_HYSTERESIS)


@compile_inner
def _append_elements(theta, wanted, first, elements, slots, count):
    """List the elements with friction of the law of a role behind `count` others; return all."""
    for at in range(LAWS, SIZE, LAW_SIZE):
        if ROLES[int(theta[at + KIND])] != wanted:
            continue
        way = theta[at + FIRST]
        for k in range(int(theta[at + KNOTS])):
            value = theta[at + VALUES + k]
            if value != 0.0:
                elements[WAY, count], elements[STIFFNESS, count] = way, value / way
                slots[count] = first + k
                count += 1
            way *= theta[at + SPACING]
    return count


@compile_inner
def list_elements(theta, strains, elements, slots):
    """Fill elements and slots; return counts."""
    carts = _append_elements(theta, CART, 0, elements, slots, 0)
    count = _append_elements(theta, POLE, POLE_STRAINS, elements, slots, carts)
    for m in range(count):
        elements[STRAIN, m] = strains[slots[m]]
    return carts, count


@compile_inner
def keep_strains(elements, slots, counts, strains):
    """Fill strains with what the elements are strained by."""
    for m in range(counts[1]):
        strains[slots[m]] = elements[STRAIN, m]


@compile_inner
def _pull(elements, m, move):
    """Return the force of element m after a move."""
    way = elements[WAY, m]
    return elements[STIFFNESS, m] * min(max(elements[STRAIN, m] + move, -way), way)


@compile_inner
def _sum_pulls(elements, begin, stop, move):
    """Return the force of some elements; four sums, so that the processor adds side by side."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    whole = stop - (stop - begin) % 4
    for m in range(begin, whole, 4):
        a += _pull(elements, m, move)
        b += _pull(elements, m + 1, move)
        c += _pull(elements, m + 2, move)
        d += _pull(elements, m + 3, move)
    for m in range(whole, stop):
        a += _pull(elements, m, move)
    return (a + b) + (c + d)


@compile_inner
def sum_hysteresis(elements, counts, move, turn):
    """Return the force on the cart, N, and the torque on the pole, N m, of all elements."""
    carts, count = counts
    return -_sum_pulls(elements, 0, carts, move), -_sum_pulls(elements, carts, count, turn)


@compile_inner
def _follow(elements, begin, stop, move):
    """Strain some elements by a move, in place."""
    for m in range(begin, stop):
        way = elements[WAY, m]
        elements[STRAIN, m] = min(max(elements[STRAIN, m] + move, -way), way)


@compile_inner
def follow_strains(elements, counts, move, turn):
    """Strain the elements by a move and a turn, in place."""
    carts, count = counts
    _follow(elements, 0, carts, move)
    _follow(elements, carts, count, turn)


@compile_inner
def sum_cart_levels(theta):
    """Return the friction of all elements of the cart once they slip, N."""
    total = 0.0
    for at in range(LAWS, SIZE, LAW_SIZE):
        if ROLES[int(theta[at + KIND])] == CART:
            for k in range(int(theta[at + KNOTS])):
                total += theta[at + VALUES + k]
    return total
