"""Whether a recording shows motion that can say anything about a rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats


def leave_out_still_cart(recording: Recording, state: SmoothState) -> Recording:
    """Take out a cart that was never told to move and did not; the pole alone is left.

    Raises UnusableRecording when nothing moves, or when the cart does not although it is
    commanded.
    """
    signals = recording.signals
    cart, pole = (_is_moving(values, noise) for values, noise in _list_joints(recording, state))
    commanded = bool(np.any(np.abs(signals.command) > 0))
    if signals.cart is not None and not cart and commanded:
        raise UnusableRecording(
            "expected the cart to answer the command, found it standing still all the time: "
            "check the drive, the stop and the command topic, and record again"
        )
    if not cart and not pole:
        raise UnusableRecording(
            "expected motion, found every joint standing still: record while the rig moves"
        )
    if signals.cart is not None and not cart:
        return replace(recording, signals=replace(signals, cart=None))
    return recording


def _list_joints(
    recording: Recording, state: SmoothState
) -> tuple[tuple[Floats | None, float | None], ...]:
    signals = recording.signals
    return (signals.cart, state.noise.cart_m), (signals.pole, state.noise.pole_rad)


def _is_moving(values: Floats | None, noise: float | None) -> bool:
    return (
        values is not None
        and noise is not None
        and float(np.ptp(values)) > decisions.MOVING_DEVIATIONS * noise
    )
