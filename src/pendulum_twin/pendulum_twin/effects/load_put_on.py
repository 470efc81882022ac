"""A load is put on the cart, or taken off it, at an instant.

The load is handed over at the cart's speed: the velocities do not jump.
"""

from dataclasses import replace

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale
from pendulum_twin.rig import Rig

# Of what the cart could lose before the pole alone would move it: a cart without mass has none.
MOST_TAKEN_OFF = 0.95


def law(t, h, mass_kg, coupling_kg_m, inertia_kg_m2, load_kg, time_s):
    """Return the mass that is added over a step of h s, kg; t is the step's middle, s.

    In the step of the instant it is the mass under which a level force gives the velocity that it
    gives both masses in turn.
    """
    spare = max(mass_kg - coupling_kg_m * coupling_kg_m / inertia_kg_m2, 0.0)
    there = min(max((t - time_s) / h + 0.5, 0.0), 1.0)
    load = max(load_kg, -MOST_TAKEN_OFF * spare)
    return load * there * mass_kg / (mass_kg + load - load * there)


def put_load_on(rig: Rig, load_kg: float, time_s: float) -> Rig:
    """Return the rig with the load on its cart; a cart keeps some mass, as in the law."""
    if rig.cart_mass_kg is None:
        return rig
    spare, distance_m = rig.cart_mass_kg, None
    if rig.pole_inertia_kg_m2 is not None:
        spare = min(spare, rig.total_mass_kg - rig.moment_kg_m**2 / rig.pole_inertia_kg_m2)
    load_kg = max(load_kg, -MOST_TAKEN_OFF * spare)
    if rig.has_pole:
        distance_m = rig.moment_kg_m / (rig.total_mass_kg + load_kg)
    return replace(rig, cart_mass_kg=rig.cart_mass_kg + load_kg, com_distance_m=distance_m)


EFFECT = Effect(
    name="load_put_on",
    place=Place.CART,
    form=Form.TIMED_MASS,
    law=law,
    constants=("mass_kg", "coupling_kg_m", "inertia_kg_m2"),
    parameters=(
        Parameter("load_kg", "kg", 0.0, -1e3, 1e3, (0.1,)),
        # An instant next to an end of the recording has no motion on its other side to differ
        # from: the load would stand for how the recording begins, and for a mass that is wrong.
        Parameter(
            "time_s",
            "s",
            0.0,
            0.0,
            1e6,
            (0.5,),
            Scale.CLOCK_END,
            shape=True,
            most=0.95,
            fewest=0.05,
            instant=True,
        ),
    ),
    sentence="From {time_s} on the cart carries {load_kg} more (below 0: less).",
    source="Newton's second law with a mass that steps; K. J. Astrom and B. Wittenmark, Adaptive "
    "Control (1995), section 1.3",
    of_recording=True,
    rig_after=put_load_on,
    timed=True,
)
