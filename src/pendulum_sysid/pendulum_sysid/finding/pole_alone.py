"""The pole by itself: its axis moves as the cart was recorded, and the cart has no model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_twin.signals import Floats
from pendulum_twin.simulate import undo_sensors


def put_pole_on_moving_axis(case: Case, theta: Floats) -> Case | None:
    """Make the case of the pole alone; None unless the recording holds cart and pole.

    What the cart's model lacks does not reach the pole then.

    theta: (SIZE,) parameter vector, for the sign of the cart's sensor.

    The command of the new case is the mean acceleration of the pole's axis over each period,
    m/s^2, from the smoothed velocities.
    """
    signals = case.signals
    if signals.cart is None or signals.pole is None:
        return None
    v = undo_sensors(case.state.states[None], theta[None], signals.clock_s)[0][:, 2]
    acceleration = np.zeros(len(signals))
    for stretch in signals.stretches:
        acceleration[stretch] = np.append(np.diff(v[stretch]), 0.0) / signals.period_s
    alone = replace(
        signals,
        command=acceleration,
        cart=None,
        pole_valid=signals.pole_valid & signals.cart_valid,
    )
    return make_case(replace(case.recording, signals=alone), smooth_state(alone), case.twin)
