"""Find the period of a pulley off its axis that measures the cart's position.

An error of the position shows as a force: the cart's mass times the error's second derivative.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Use
from pendulum_sysid.finding.detectors.force_waves import fit_waves, list_wavenumbers
from pendulum_sysid.finding.localisation.balance import FORCE, compute_motion, make_balance
from pendulum_sysid.finding.localisation.thinning import thin_out
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import eccentric_pulley
from pendulum_twin.parameter_vector import MASS

EFFECT = eccentric_pulley.EFFECT


def read_pulley(case: Case, theta: Floats) -> tuple[Reading, ...]:
    """Return the error that explains most of the cart's missing force; none without a cart.

    theta: (SIZE,) of the twin fitted so far.
    """
    case = thin_out(case)
    balance = make_balance(case, theta, FORCE)
    here = compute_motion(case, theta)
    travel = float(np.ptp(here.x))
    if balance is None or travel <= 0.0:
        return ()
    mass = float(theta[MASS])

    def make_columns(wavenumber: float) -> Floats:
        sine, cosine = np.sin(wavenumber * here.x), np.cos(wavenumber * here.x)
        bend, slope = -(wavenumber**2) * here.v**2, wavenumber * here.a
        columns: Floats = mass * np.stack(
            [bend * sine + slope * cosine, bend * cosine - slope * sine], axis=1
        )
        return columns

    tried = list_wavenumbers(travel, EFFECT.parameters[1])
    wave = fit_waves(balance, make_columns, tried)
    ratio = min(wave.amplitude * wave.wavenumber, EFFECT.parameters[0].high)
    return (Reading(EFFECT.name, (ratio, 2.0 * np.pi / wave.wavenumber, wave.phase)),)


DETECTOR = Detector(EFFECT, Use.START, read_pulley)
