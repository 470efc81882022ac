"""Find a wrong scale of the measured angle: the scale that balances the pole's torque best.

With a scale that is off by r, the angle of a pole that has gone round n times is off by 2 pi n r.
Runs lose it, and no small step leads back. The balance of the torque judges every sample by
itself.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import angle_scale
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.sensors import undo_sensors

EFFECT = angle_scale.EFFECT
RATIOS = np.linspace(-0.15, 0.15, 121)


def read_scale(sight: Sight) -> tuple[Reading, ...]:
    """Return the ratio that balances the torque best; the effect's typical size where it is 0."""
    ratio = find_balancing_ratio(sight.case, sight.theta) or EFFECT.parameters[0].probes[0]
    return (Reading(EFFECT.name, (ratio,)),)


def find_balancing_ratio(case: Case, theta: Floats) -> float:
    """Return the ratio, of RATIOS, with which the base model explains the pole's motion best."""
    signals, state = case.signals, case.state
    usable = signals.pole_valid & (signals.cart_valid if signals.cart is not None else True)
    states, clock_s = state.states[None, usable], signals.clock_s[usable]
    a, b = state.accelerations[usable].T
    if signals.cart is None:  # the axis of a pole alone is moved by the command
        a = signals.command[usable]
    theta = theta.copy()

    def compute_unexplained_power(ratio: float) -> float:
        theta[SLOTS[EFFECT.name]] = ratio
        _, th, _, w = undo_sensors(states, theta[None], clock_s)[0].T
        return _compute_unexplained_power(th, w, a, b)

    return min(RATIOS.tolist(), key=compute_unexplained_power)


def _compute_unexplained_power(th: Floats, w: Floats, a: Floats, b: Floats) -> float:
    """Return the power of the pole's acceleration that weight, coupling and friction leave.

    The constants of these terms are fitted, whatever their values.

    th, w: (n,) true angle, rad, and rate, rad/s.
    a, b: (n,) acceleration of the axis, m/s^2, and of the pole, rad/s^2.
    """
    sine, cosine = np.sin(th), np.cos(th)
    terms = np.stack([sine, cosine * a, cosine, w, np.sign(w)])
    likeness, power = terms @ b, float(b @ b)
    weights = np.linalg.lstsq(terms @ terms.T, likeness, rcond=None)[0]
    return power - float(likeness @ weights)


DETECTOR = Detector(EFFECT, Use.START, read_scale)
