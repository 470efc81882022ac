"""Rigs and runs that the tests of the twin share."""

from collections.abc import Mapping

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Signals

POLE = {
    "pole_mass_kg": 0.12,
    "com_distance_m": 0.01955717,
    "pole_inertia_kg_m2": 0.00292,
    "pole_viscous_n_m_s": 27.344e-5,
}
CART = {"cart_mass_kg": 0.5723, "force_per_pwm_n": 12.86, "cart_viscous_n_s_m": 0.5}
THESIS = Rig(**CART, **POLE)  # table 1
FRICTIONLESS = Rig(**(CART | {"cart_viscous_n_s_m": 0.0}), **(POLE | {"pole_viscous_n_m_s": 0.0}))
CART_ALONE = Rig(**CART)
SLIDING_CART = Rig(**(CART | {"cart_viscous_n_s_m": 0.0}))
POLE_ALONE = Rig(**(POLE | {"pole_viscous_n_m_s": 0.0, "com_distance_m": 0.12}))
HANGING = (0.0, np.pi, 0.0, 0.0)
X, TH, V, W = range(4)

Effects = Mapping[str, Mapping[str, float]]


def recording(command: Floats, period_s: float) -> Signals:
    """Return a recording of a command; what was measured does not matter to a free run."""
    anywhere, valid = np.zeros(len(command)), np.ones(len(command), dtype=bool)
    return Signals(period_s, command, anywhere, anywhere, valid, valid)


def run(
    rig: Rig,
    command: Floats,
    effects: Effects | None = None,
    start: tuple[float, ...] = HANGING,
    period_s: float = 0.01,
) -> Floats:
    """Return the measured states (samples, 4) of a twin that is driven from a start state."""
    theta = make_theta(Twin("test", rig, effects or {}))[None]
    first = np.zeros(1, dtype=np.int64)
    return run_freely(
        recording(command, period_s), theta, first, first, np.array([start]), len(command)
    )[0]


def wild_command(samples: int) -> Floats:
    """Return a command that swings the pole right round and lets the cart come to rest."""
    t = 0.01 * np.arange(samples)
    return 0.4 * np.sin(5.0 * t) * np.sin(0.7 * t)
