"""Find a wrong scale of the measured angle: the scale that balances the pole's torque best.

With a scale that is off by r, the angle of a pole that has gone round n times is off by 2 pi n r.
Runs lose it, and no small step leads back. The balance of the torque judges every sample by
itself.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Use
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import angle_scale
from pendulum_twin.parameter_vector import SLOTS
from pendulum_twin.sensors import undo_sensors

EFFECT = angle_scale.EFFECT
RATIOS = np.linspace(-0.15, 0.15, 121)


def read_scale(case: Case, theta: Floats) -> tuple[Reading, ...]:
    """Return the ratio that balances the torque best; the effect's typical size where it is 0.

    theta: (SIZE,) of the twin so far, for the other effects of the sensors.
    """
    ratio = find_balancing_ratio(case, theta) or EFFECT.parameters[0].probes[0]
    return (Reading(EFFECT.name, (ratio,)),)


def find_balancing_ratio(case: Case, theta: Floats) -> float:
    """Return the ratio, of RATIOS, with which the base model explains the pole's motion best."""
    unexplained = [_compute_unexplained_share(case, theta, ratio) for ratio in RATIOS]
    return float(RATIOS[int(np.argmin(unexplained))])


def _compute_unexplained_share(case: Case, theta: Floats, ratio: float) -> float:
    """Return the share of the pole's acceleration that weight, coupling and friction leave.

    The constants of these terms are fitted, whatever their values.
    """
    theta = theta.copy()
    theta[SLOTS[EFFECT.name]] = ratio
    signals, state = case.signals, case.state
    usable = signals.pole_valid & (signals.cart_valid if signals.cart is not None else True)
    _, th, _, w = undo_sensors(state.states[None], theta[None], signals.clock_s)[0][usable].T
    a, b = state.accelerations[usable].T
    if signals.cart is None:  # the axis of a pole alone is moved by the command
        a = signals.command[usable]
    terms = np.stack([np.sin(th), np.cos(th) * a, np.cos(th), w, np.sign(w)], axis=1)
    likeness, power = terms.T @ b, float(b @ b)
    weights = np.linalg.lstsq(terms.T @ terms, likeness, rcond=None)[0]
    return (power - float(likeness @ weights)) / max(power, 1e-300)


DETECTOR = Detector(EFFECT, Use.START, read_scale)
