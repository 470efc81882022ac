"""Find the period of a pulley off its axis that measures the cart's position.

An error of the position shows as a force: the cart's mass times the error's second derivative.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.detectors.force_waves import fit_waves, list_wavenumbers
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import eccentric_pulley
from pendulum_twin.parameter_vector import MASS

EFFECT = eccentric_pulley.EFFECT


def read_pulley(sight: Sight) -> tuple[Reading, ...]:
    """Return the error that explains most of the cart's missing force; none without a cart."""
    balance, here = sight.force, sight.motion
    travel = float(np.ptp(here.x))
    if balance is None or travel <= 0.0:
        return ()
    mass = float(sight.theta[MASS])

    def make_columns(wavenumbers: Floats, sines: Floats, cosines: Floats) -> Floats:
        bend, slope = -(wavenumbers**2) * here.v[:, None] ** 2, wavenumbers * here.a[:, None]
        columns: Floats = mass * np.stack(
            [bend * sines + slope * cosines, bend * cosines - slope * sines], axis=1
        )
        return columns

    tried = list_wavenumbers(travel, EFFECT.parameters[1])
    wave = fit_waves(balance, here.x, make_columns, tried)
    ratio = min(wave.amplitude * wave.wavenumber, EFFECT.parameters[0].high)
    return (Reading(EFFECT.name, (ratio, 2.0 * np.pi / wave.wavenumber, wave.phase)),)


DETECTOR = Detector(EFFECT, Use.START, read_pulley)
