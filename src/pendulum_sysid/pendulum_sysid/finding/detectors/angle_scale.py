"""By which scale the measured angle balances the pole's torque best: a start for a fit that runs cannot give.

With a scale that is off by r, the angle of a pole that has gone round n times is off by 2 pi n r:
runs lose it, and no small step leads back. The balance of the torque asks every sample by itself.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_twin.effects import angle_scale
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.signals import Floats
from pendulum_twin.simulate import undo_sensors

RATIOS = np.linspace(-0.15, 0.15, 121)


def balancing_ratio(case: Case, theta: Floats) -> float:
    """Return the ratio of `angle_scale`, of RATIOS, for which the base model's terms explain the pole's acceleration best.

    theta: (SIZE,) of the twin so far, for the other effects of the sensors.
    """
    return float(RATIOS[int(np.argmin([_unbalanced(case, theta, ratio) for ratio in RATIOS]))])


def _unbalanced(case: Case, theta: Floats, ratio: float) -> float:
    """Return the share of the pole's acceleration that weight, coupling and friction leave, whatever their constants."""
    theta = theta.copy()
    theta[SLOTS[angle_scale.EFFECT.name]] = ratio
    signals, state = case.signals, case.state
    usable = signals.pole_valid & (signals.cart_valid if signals.cart is not None else True)
    _, th, _, w = undo_sensors(state.states[None], theta[None], signals.clock_s)[0][usable].T
    a, b = state.accelerations[usable].T
    terms = np.stack([np.sin(th), np.cos(th) * a, np.cos(th), w, np.sign(w)], axis=1)
    left = b - terms @ np.linalg.lstsq(terms, b, rcond=None)[0]
    return float(np.mean(left**2) / max(float(np.mean(b**2)), 1e-300))
