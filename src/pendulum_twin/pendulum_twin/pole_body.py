"""Ask whether bodies exist that have a rig's masses, centre of mass and inertia.

With m the mass of cart and pole, S = m l their first moment about the axis, mp the pole's mass and
Jp its inertia about the axis: the mass matrix is positive definite at every angle when
m Jp > S^2. A pole of this inertia exists when mp Jp >= S^2 (parallel axis theorem). The first is
asked of every rig, the second of twin files: a rig that was fitted or drawn may lie beyond, for
its motion depends on the sum of the masses alone.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from pendulum_twin.errors import BadInputError

if TYPE_CHECKING:
    from pendulum_twin.rig import Rig

# A twin file may give this key in place of com_distance_m: from the axis to the centre of mass of
# the pole alone.
POLE_COM_KEY = "pole_com_distance_m"
# What is the least inertia that a pole may have, as a share of that of a point at its centre of
# mass? Beside a cart: numbers of three digits are off by up to 2 %. A pole alone moves by
# com_distance_m / inertia alone, and a fit moves com_distance_m for an inertia that is wrong: both
# wrong by 20 % leave a rod 0.59; a rod's inertia about its centre of mass has 0.33.
LEAST_INERTIA_SHARE = 0.98
LEAST_INERTIA_SHARE_ALONE = 0.5
# What is the largest inertia of a likely pole, as the same share? A rod has 1.33, the INTECO rig's
# pole with its weight 1.9.
MOST_INERTIA_SHARE = 4.0


def check_mass_matrix(rig: Rig) -> None:
    """Raise BadInputError when the mass matrix of cart and pole is not positive definite."""
    assert rig.pole_inertia_kg_m2 is not None and rig.pole_mass_kg is not None
    mass, moment, inertia = rig.total_mass_kg, rig.moment_kg_m, rig.pole_inertia_kg_m2
    if not mass * inertia > moment**2:
        distance = moment / rig.pole_mass_kg
        raise BadInputError(
            f"pole_inertia_kg_m2: expected more than {moment**2 / mass:.4g} for cart_mass_kg "
            f"{rig.cart_mass_kg:g}, pole_mass_kg {rig.pole_mass_kg:g} and com_distance_m "
            f"{rig.com_distance_m:g}, found {inertia:g}: no bodies move like that. "
            f"{_suggest_reading(inertia, rig.pole_mass_kg, distance, rig.com_distance_m)}"
        )


def check_pole_body(rig: Rig) -> None:
    """Raise BadInputError when no pole of the rig's pole mass has its inertia."""
    if rig.pole_mass_kg is None or rig.pole_inertia_kg_m2 is None:
        return
    check_inertia(
        rig.pole_inertia_kg_m2,
        rig.pole_mass_kg,
        rig.moment_kg_m / rig.pole_mass_kg,
        rig.has_cart,
        rig.com_distance_m,
    )


def check_inertia(
    inertia: float, mass: float, distance: float, has_cart: bool, given_m: float | None = None
) -> None:
    """Raise BadInputError when no pole has this inertia about its axis.

    inertia: kg m^2.
    mass: kg, of the pole.
    distance: m, from the axis to the pole's centre of mass.
    has_cart: whether the pole hangs on a cart that moves.
    given_m: m, com_distance_m as it was given; None when the pole's own was.
    """
    least = mass * distance**2
    if inertia < (LEAST_INERTIA_SHARE if has_cart else LEAST_INERTIA_SHARE_ALONE) * least:
        raise BadInputError(
            f"pole_inertia_kg_m2: expected at least {least:.4g} for a pole of {mass:g} kg with "
            f"its centre of mass {distance:.4g} m from the axis, found {inertia:g}. "
            f"{_suggest_reading(inertia, mass, distance, given_m if has_cart else None)}"
        )


def move_mass_to_pole(rig: Rig) -> Rig:
    """Return the rig with as much of the cart's mass in the pole as makes the pole exist.

    Total mass, first moment and inertia, and with them all motion, stay the same.
    """
    if not (rig.has_cart and rig.pole_mass_kg and rig.pole_inertia_kg_m2):
        return rig
    lightest = rig.moment_kg_m**2 / rig.pole_inertia_kg_m2
    if rig.pole_mass_kg >= LEAST_INERTIA_SHARE * lightest:
        return rig
    return replace(rig, cart_mass_kg=rig.total_mass_kg - lightest, pole_mass_kg=lightest)


def _suggest_reading(inertia: float, mass: float, distance: float, given_m: float | None) -> str:
    """Return which number probably means something else, and what to give in its place.

    inertia, mass, distance: as for `check_inertia`.
    given_m: m, com_distance_m of a rig with a cart; None when it cannot be meant otherwise.
    """
    axis = (
        "probably about the centre of mass: about the axis it would be "
        f"{inertia + mass * distance**2:.4g}"
    )
    share = math.inf if given_m is None else inertia / (mass * given_m**2)
    if not LEAST_INERTIA_SHARE <= share <= MOST_INERTIA_SHARE:
        return f"pole_inertia_kg_m2 is {axis}"
    return (
        f"com_distance_m is probably that of the pole alone: give it as {POLE_COM_KEY}, for "
        f"com_distance_m is that of cart and pole together. If not, pole_inertia_kg_m2 is {axis}"
    )
