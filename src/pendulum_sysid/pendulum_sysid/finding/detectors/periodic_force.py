"""Find the frequency of a force on the cart that is periodic in time."""

from __future__ import annotations

import numpy as np

from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.finding.detectors.force_waves import find_wave
from pendulum_sysid.finding.localisation.table import Table
from pendulum_sysid.finding.localisation.waves import find_vibration_hz
from pendulum_twin.effects import periodic_force
from pendulum_twin.sensors import compute_paces

EFFECT = periodic_force.EFFECT
AROUND = np.linspace(-1.0, 1.0, 9)  # of the spectrum's resolution, to either side of its peak


def read_vibration(sight: Sight) -> tuple[Reading, ...]:
    """Return the clearest line of the cart's missing force; none where no line stands out."""
    balance, signals = sight.force, sight.thinned.signals
    if balance is None:
        return ()
    hertz = find_vibration_hz(balance, Table(balance, []).compute_residual(()))
    if hertz is None:
        return ()
    pace, clock_s = float(compute_paces(sight.theta)), signals.clock_s
    tried = 2.0 * np.pi * (hertz + AROUND / signals.seconds) / pace
    wave = find_wave(balance, np.ones_like(clock_s), clock_s * pace, tried)
    return (Reading(EFFECT.name, (wave.amplitude, wave.wavenumber / (2.0 * np.pi), wave.phase)),)


DETECTOR = Detector(EFFECT, Use.START, read_vibration)
