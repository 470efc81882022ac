"""Find the period of a ripple of the force per command along the rail."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.detectors.force_waves import find_wave, list_wavenumbers
from pendulum_twin.effects import force_ripple
from pendulum_twin.parameter_vector import FORCE_PER_PWM

EFFECT = force_ripple.EFFECT


def read_ripple(sight: Sight) -> tuple[Reading, ...]:
    """Return the ripple that explains most of the cart's missing force; none without a cart."""
    balance, here = sight.force, sight.motion
    travel = float(np.ptp(here.x))
    if balance is None or travel <= 0.0:
        return ()
    tried = list_wavenumbers(travel, EFFECT.parameters[1])
    wave = find_wave(balance, sight.theta[FORCE_PER_PWM] * here.u, here.x, tried)
    ratio = min(wave.amplitude, EFFECT.parameters[0].high)
    return (Reading(EFFECT.name, (ratio, 2.0 * np.pi / wave.wavenumber, wave.phase)),)


DETECTOR = Detector(EFFECT, Use.START, read_ripple)
