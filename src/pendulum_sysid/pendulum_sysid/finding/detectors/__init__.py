"""The detectors, a file each: what is read off a recording instead of fitted."""

from __future__ import annotations

from pendulum_sysid.finding.detectors import (
    angle_scale,
    coarse_command,
    eccentric_pulley,
    encoder_slip,
    force_ripple,
    load_put_on,
    periodic_force,
    steady_friction,
    velocity_filter,
)
from pendulum_sysid.finding.detectors.detector import Detector, Reading, Sight, Use
from pendulum_sysid.fitting.case import Case
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Effect

DETECTORS: tuple[Detector, ...] = (
    encoder_slip.DETECTOR,
    angle_scale.DETECTOR,
    force_ripple.DETECTOR,
    load_put_on.DETECTOR,
    coarse_command.DETECTOR,
    eccentric_pulley.DETECTOR,
    periodic_force.DETECTOR,
    velocity_filter.DETECTOR,
    steady_friction.DETECTOR,
)


def find_start_detector(effect: Effect) -> Detector | None:
    """Return the detector from whose readings fits of an effect start; None where it has none."""
    detectors = (d for d in DETECTORS if d.effect == effect and d.use is Use.START)
    return next(detectors, None)


def read_effects(case: Case, theta: Floats, use: Use) -> tuple[Reading, ...]:
    """Return the readings of one use about the effects that the given twin lacks.

    theta: (SIZE,) of the twin fitted so far.
    """
    sight = Sight(case, theta)
    return tuple(
        reading
        for detector in DETECTORS
        if detector.use is use and detector.effect.name not in case.twin.effects
        for reading in detector.read(sight)
    )
