"""Whether a recording shows motion that can say anything about a rig."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.records import Recording
from pendulum_twin.arrays import Floats

STANDARD_GRAVITY_M_S2 = 9.81


def leave_out_still_cart(recording: Recording, state: SmoothState) -> Recording:
    """Take out a cart that was never told to move and did not; the pole alone is left.

    Raises UnusableRecording when nothing moves, when the cart does not although it is commanded,
    or when the pole does not although the cart is pushed to and fro.
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
    if cart and not pole and signals.pole is not None and _must_swing(recording, state):
        raise UnusableRecording(
            "expected the pole to swing when its cart is pushed, found its angle standing still: "
            "check the pole's encoder, or leave out the pole where it is locked"
        )
    if signals.cart is not None and not cart:
        return replace(recording, signals=replace(signals, cart=None))
    return recording


def _list_joints(
    recording: Recording, state: SmoothState
) -> tuple[tuple[Floats | None, float | None], ...]:
    signals = recording.signals
    return (signals.cart, state.noise.cart_m), (signals.pole, state.noise.pole_rad)


def _must_swing(recording: Recording, state: SmoothState) -> bool:
    """Tell whether the cart's accelerations tilt a hanging pole further than noise does.

    A cart that accelerates slowly tilts its pole by the acceleration over gravity.
    """
    signals, noise = recording.signals, state.noise.pole_rad
    samples = max(round(decisions.ANSWER_FILTER_S / signals.period_s), 1)
    pushes = np.convolve(state.accelerations[:, 0], np.full(samples, 1.0 / samples), mode="same")
    tilt = float(np.sqrt(np.mean(pushes**2))) / STANDARD_GRAVITY_M_S2
    return noise is not None and tilt > decisions.MOVING_DEVIATIONS * noise


def _is_moving(values: Floats | None, noise: float | None) -> bool:
    return (
        values is not None
        and noise is not None
        and float(np.ptp(values)) > decisions.MOVING_DEVIATIONS * noise
    )
