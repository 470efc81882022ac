"""Evaluate the measured hysteresis of a block of lanes: elements that strain, then slip.

Each knot of such a law is a spring in series with dry friction. It strains with its joint until it
has gone the knot's way, then slips, and holds back with the value at the knot (W. D. Iwan, J.
Applied Mechanics 33 (1966) 893; its element is the stop operator of M. Brokate and J. Sprekels,
Hysteresis and Phase Transitions (1996), section 2.1). Most elements of a fitted law have no
friction, so a block lists those that have some in any lane; an element without friction adds an
exact 0, so a lane's sums do not depend on its neighbours. Arguments:
theta: (SIZE,) of one lane.
elements: (3, STRAINS, width) of each lane's elements: way until it slips, m or rad; stiffness, N/m
    or N m/rad; what it is strained by, m or rad. The elements of the cart come first.
listed: (STRAINS,) which elements have friction; counts: how many of them the cart has, and how
    many cart and pole have.
moves: (2, width) of cart, m, and pole, rad, since the strains were taken.
loads: (2, width) force on the cart, N, and torque on the pole, N m.
"""

from __future__ import annotations

import numpy as np

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
def make_elements(width, remembers):
    """Return elements, listed, moves and loads of a block, still empty.

    remembers: whether a twin has measured hysteresis; else there are no elements.
    """
    strains = STRAINS if remembers else 0
    listed = np.empty(strains, dtype=np.int64)
    return np.empty((3, strains, width)), listed, np.empty((2, width)), np.empty((2, width))


@compile_inner
def place_elements(theta, strains, elements, i):
    """Place the elements of a twin, strained by strains (STRAINS,), in lane i."""
    for k in range(STRAINS):
        elements[WAY, k, i], elements[STIFFNESS, k, i] = 0.0, 0.0
        elements[STRAIN, k, i] = strains[k]
    for at in range(LAWS, SIZE, LAW_SIZE):
        role = ROLES[int(theta[at + KIND])]
        if role in (CART, POLE):
            first = 0 if role == CART else POLE_STRAINS
            way = theta[at + FIRST]
            for k in range(int(theta[at + KNOTS])):
                value = theta[at + VALUES + k]
                elements[WAY, first + k, i] = way
                elements[STIFFNESS, first + k, i] = value / way if value != 0.0 else 0.0
                way *= theta[at + SPACING]


@compile_inner
def list_elements(elements, listed):
    """Fill listed; return counts."""
    carts, count = 0, 0
    for k in range(STRAINS):
        if np.any(elements[STIFFNESS, k] != 0.0):
            listed[count] = k
            count += 1
            carts += 1 if k < POLE_STRAINS else 0
    return carts, count


@compile_inner
def keep_strains(elements, i, strains):
    """Fill strains (STRAINS,) with what the elements of lane i are strained by."""
    for k in range(STRAINS):
        strains[k] = elements[STRAIN, k, i] if elements[STIFFNESS, k, i] != 0.0 else 0.0


@compile_inner
def sum_hysteresis(elements, listed, counts, moves, loads):
    """Fill loads with what the elements do at their strains and moves."""
    width = elements.shape[2]
    loads[:] = 0.0
    for m in range(counts[1]):
        k, joint = listed[m], 0 if m < counts[0] else 1
        for i in range(width):
            way = elements[WAY, k, i]
            strain = min(max(elements[STRAIN, k, i] + moves[joint, i], -way), way)
            loads[joint, i] -= elements[STIFFNESS, k, i] * strain


@compile_inner
def follow_strains(elements, listed, counts, moves):
    """Strain the elements by moves, in place."""
    width = elements.shape[2]
    for m in range(counts[1]):
        k, joint = listed[m], 0 if m < counts[0] else 1
        for i in range(width):
            way = elements[WAY, k, i]
            strain = elements[STRAIN, k, i] + moves[joint, i]
            elements[STRAIN, k, i] = min(max(strain, -way), way)


@compile_inner
def sum_cart_levels(theta):
    """Return the friction of all elements of the cart once they slip, N."""
    total = 0.0
    for at in range(LAWS, SIZE, LAW_SIZE):
        if ROLES[int(theta[at + KIND])] == CART:
            for k in range(int(theta[at + KNOTS])):
                total += theta[at + VALUES + k]
    return total
