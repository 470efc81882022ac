"""Find the period of a wave along the rail: of the cart's force, or of the force per command.

Over many waves a period that is off by a part in a hundred is out of step, so no list of typical
periods holds the right period.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.detectors.force_waves import find_wave, list_wavenumbers
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import cogging, force_ripple
from pendulum_twin.effects.effect import Effect
from pendulum_twin.parameter_vector import FORCE_PER_PWM


def read_cogging(sight: Sight) -> tuple[Reading, ...]:
    """Return the wave that explains most of the cart's missing force; none without a cart."""
    return _read_wave(sight, cogging.EFFECT, np.ones_like(sight.motion.x))


def read_ripple(sight: Sight) -> tuple[Reading, ...]:
    """Return the ripple that explains most of the cart's missing force; none without a cart."""
    drive = sight.theta[FORCE_PER_PWM] * sight.motion.u
    return _read_wave(sight, force_ripple.EFFECT, drive)


def _read_wave(sight: Sight, effect: Effect, factor: Floats) -> tuple[Reading, ...]:
    """Return the wave of an effect with an amplitude, a period (m) and a phase (rad).

    factor: (n,) force of the effect where its wave is 1 and its amplitude is 1, N.
    """
    balance, here = sight.force, sight.motion
    travel = float(np.ptp(here.x))
    if balance is None or travel <= 0.0:
        return ()
    amplitude, period, _ = effect.parameters
    wave = find_wave(balance, factor, here.x, list_wavenumbers(travel, period))
    size = min(wave.amplitude, amplitude.high)
    return (Reading(effect.name, (size, 2.0 * np.pi / wave.wavenumber, wave.phase)),)


COGGING = Detector(cogging.EFFECT, Use.START, read_cogging)
RIPPLE = Detector(force_ripple.EFFECT, Use.START, read_ripple)
