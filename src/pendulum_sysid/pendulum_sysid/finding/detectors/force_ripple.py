"""Find the period of a ripple of the force per command along the rail."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Use
from pendulum_sysid.finding.detectors.force_waves import find_wave, list_wavenumbers
from pendulum_sysid.finding.localisation.balance import FORCE, compute_motion, make_balance
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import force_ripple
from pendulum_twin.parameter_vector import FORCE_PER_PWM

EFFECT = force_ripple.EFFECT


def read_ripple(case: Case, theta: Floats) -> tuple[Reading, ...]:
    """Return the ripple that explains most of the cart's missing force; none without a cart.

    theta: (SIZE,) of the twin fitted so far.
    """
    case = thin_out(case)
    balance = make_balance(case, theta, FORCE)
    here = compute_motion(case, theta)
    travel = float(np.ptp(here.x))
    if balance is None or travel <= 0.0:
        return ()
    tried = list_wavenumbers(travel, EFFECT.parameters[1])
    wave = find_wave(balance, theta[FORCE_PER_PWM] * here.u, here.x, tried)
    ratio = min(wave.amplitude, EFFECT.parameters[0].high)
    return (Reading(EFFECT.name, (ratio, 2.0 * np.pi / wave.wavenumber, wave.phase)),)


DETECTOR = Detector(EFFECT, Use.START, read_ripple)
