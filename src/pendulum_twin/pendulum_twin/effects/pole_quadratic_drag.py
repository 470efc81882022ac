"""Air drag on the pole, growing with the square of its rate."""

from pendulum_twin.effects.effect import Effect, Form, Parameter, Place, Scale


def law(x, v, th, w, n_m_s2):
    """Return -c w |w| in N m."""
    return -n_m_s2 * w * abs(w)


EFFECT = Effect(
    name="pole_quadratic_drag",
    place=Place.POLE,
    form=Form.FORCE,
    law=law,
    parameters=(
        Parameter("n_m_s2", "N m s^2", 0.0, 0.0, 1e6, (0.02,), Scale.TORQUE, Scale.POLE_RATE, 2),
    ),
    sentence="Drag of {n_m_s2} times the squared rate holds the pole back.",
    source="Nelson and Olsson, American Journal of Physics 54 (1986) 112: air drag of a pendulum",
    smooth=True,
    law_kind="pole_torque_by_rate",
)
