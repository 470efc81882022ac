"""A load that is put on the cart, or taken off it, at an instant: the rig before and after.

The cart keeps its speed. All that depends on the rig's mass is made for both rigs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from pendulum_bridge.emulator.friction import Law
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted.extra import Extra, Gain
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig


@dataclass(frozen=True)
class Load:
    """Hold a load.

    load_kg: kg, below 0 for a load that is taken off.
    time_s: s of true time at which it comes or goes.
    """

    load_kg: float
    time_s: float


def find_load(concealed: Concealed) -> Load | None:
    """Return the load that is put on the cart some time; None where there is none.

    Raises BadInputError for more mass taken off than the cart has.
    """
    values = concealed.effects.get("load_put_on")
    if values is None:
        return None
    mass_kg = concealed.rig.cart_mass_kg or 0.0
    if values["load_kg"] <= -mass_kg:
        raise BadInputError(
            f"load_put_on: load_kg: expected above {-mass_kg:g}, the cart's mass, "
            f"found {values['load_kg']:g}"
        )
    return Load(**values)


def add_load(rig: Rig, load_kg: float) -> Rig:
    """Return the rig with a load on its cart; the pole's moment stays what it is."""
    heavier = replace(rig, cart_mass_kg=(rig.cart_mass_kg or 0.0) + load_kg)
    moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
    return replace(heavier, com_distance_m=moment / heavier.total_mass_kg)


def change_laws(before: Extra, after: Extra, time_s: float) -> Extra:
    """Return the laws of the rig before until time_s, and of the rig after from then on."""
    return replace(
        before,
        gain=_select_gain(before.gain, after.gain, time_s),
        push=_select_law(before.push, after.push, time_s),
        twist=_select_law(before.twist, after.twist, time_s),
        level=_select_law(before.level, after.level, time_s),
    )


def _select_gain(before: Gain | None, after: Gain | None, time_s: float) -> Gain | None:
    if before is None or after is None:
        return None
    return lambda u, t, x, th, v, w: (before if t < time_s else after)(u, t, x, th, v, w)


def _select_law(before: Law | None, after: Law | None, time_s: float) -> Law | None:
    if before is None or after is None:
        return None
    return lambda t, x, th, v, w: (before if t < time_s else after)(t, x, th, v, w)
