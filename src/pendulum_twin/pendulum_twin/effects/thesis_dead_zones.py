"""The dead zones of the thesis's simulation: its state freezes while force and both speeds are small."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place


def law(force, v, w, force_n, cart_velocity_m_s, pole_velocity_rad_s):
    """Return whether the state stands still."""
    return abs(force) < force_n and abs(v) < cart_velocity_m_s and abs(w) < pole_velocity_rad_s


EFFECT = Effect(
    name="thesis_dead_zones",
    place=Place.CART,
    form=Form.HOLD,
    law=law,
    parameters=(
        Parameter("force_n", "N", 0.0, 0.0, 1e6, ()),
        Parameter("cart_velocity_m_s", "m/s", 0.0, 0.0, 1e3, ()),
        Parameter("pole_velocity_rad_s", "rad/s", 0.0, 0.0, 1e3, ()),
    ),
    sentence="The simulation stands still while the force is within {force_n}, the cart within "
    "{cart_velocity_m_s} and the "
    "pole within {pole_velocity_rad_s}.",
    source="the thesis's simulation, table 5: kept so that its own twin runs; it describes no rig",
    searched=False,
)
