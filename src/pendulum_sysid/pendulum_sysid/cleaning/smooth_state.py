"""The smoothed motion of a recording: states, accelerations, and the noise of its sensors."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.cleaning.sensor_noise import measure_noise
from pendulum_sysid.cleaning.smoothing import differentiate, smooth
from pendulum_sysid.records import Noise
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals


@dataclass(frozen=True)
class SmoothState:
    """Hold the smoothed motion of a recording of n samples.

    states: (n, 4) cart position (m), pole angle (rad), cart velocity (m/s), pole rate (rad/s), as
        the sensors show them; 0 for a joint that the recording lacks.
    accelerations: (n, 2) of cart (m/s^2) and pole (rad/s^2).
    noise: standard deviation of each sensor's noise.
    deviations: (4,) standard deviation of each smoothed state, which counts kinks of the motion
        as noise.
    """

    states: Floats
    accelerations: Floats
    noise: Noise
    deviations: Floats


def smooth_state(signals: Signals) -> SmoothState:
    """Smooth cart and pole, each for itself; a missing joint stays at 0.

    Accelerations, whose noise falls with the fifth power of the length, are smoothed over a longer
    length than values, and both over the same length: cart and pole are coupled through them.
    """
    states, accelerations = np.zeros((len(signals), 4)), np.zeros((len(signals), 2))
    noises: list[float | None] = [None, None]
    deviations = np.ones(4)
    joints = ((signals.cart, signals.cart_valid), (signals.pole, signals.pole_valid))
    smoothed = {
        k: (values, smooth(values, valid, signals.stretches, signals.period_s))
        for k, (values, valid) in enumerate(joints)
        if values is not None
    }
    halves = [joint.half_length for _, joint in smoothed.values()]
    longer = max(2 * min(halves), max(halves))
    for k, (values, joint) in smoothed.items():
        states[:, k], states[:, k + 2] = joint.value, joint.rate
        accelerations[:, k] = differentiate(values, signals.stretches, signals.period_s, longer, 2)
        noises[k] = measure_noise(values, joints[k][1], signals)
        deviations[[k, k + 2]] = joint.value_noise, joint.rate_noise
    return SmoothState(states, accelerations, Noise(*noises), deviations)
