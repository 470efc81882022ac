"""Evaluate the measured hysteresis of a parameter vector: elements that strain, then slip.

Each knot of such a law is a spring in series with dry friction. It strains with its joint until it
has gone the knot's way, then slips, and holds back with the value at the knot (W. D. Iwan, J.
Applied Mechanics 33 (1966) 893; its element is the stop operator of M. Brokate and J. Sprekels,
Hysteresis and Phase Transitions (1996), section 2.1). Arguments:
theta: (SIZE,) of one lane.
strains: (STRAINS,) what each element is strained by: of the cart, m, then of the pole, rad; 0 for
    an element without friction, which most are.
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
CART, POLE = int(Role.CART_HYSTERESIS), int(Role.POLE_HYSTERESIS)


@compile_inner
def _sum_elements(theta, at, strains, first, move):
    """Return what the elements of the law at a slot hold back with after a move, N or N m."""
    total, way, ratio = 0.0, theta[at + FIRST], theta[at + SPACING]
    for k in range(int(theta[at + KNOTS])):
        value = theta[at + VALUES + k]
        if value != 0.0:
            total += value * (min(max(strains[first + k] + move, -way), way) / way)
        way *= ratio
    return total


@compile_inner
def _strain_elements(theta, at, strains, first, move):
    """Strain the elements of the law at a slot by a move, in place."""
    way, ratio = theta[at + FIRST], theta[at + SPACING]
    for k in range(int(theta[at + KNOTS])):
        if theta[at + VALUES + k] != 0.0:
            strains[first + k] = min(max(strains[first + k] + move, -way), way)
        way *= ratio


@compile_inner
def sum_hysteresis(theta, strains, move, turn):
    """Return the force on the cart, N, and the torque on the pole, N m, of all elements."""
    force, torque = 0.0, 0.0
    for at in range(LAWS, SIZE, LAW_SIZE):
        role = ROLES[int(theta[at + KIND])]
        if role == CART:
            force -= _sum_elements(theta, at, strains, 0, move)
        elif role == POLE:
            torque -= _sum_elements(theta, at, strains, POLE_STRAINS, turn)
    return force, torque


@compile_inner
def follow_strains(theta, strains, move, turn):
    """Strain the elements by a move and a turn, in place."""
    for at in range(LAWS, SIZE, LAW_SIZE):
        role = ROLES[int(theta[at + KIND])]
        if role == CART:
            _strain_elements(theta, at, strains, 0, move)
        elif role == POLE:
            _strain_elements(theta, at, strains, POLE_STRAINS, turn)
