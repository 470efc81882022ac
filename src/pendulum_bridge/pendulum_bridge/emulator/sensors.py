"""From the true state to the reported sample: zeros, scales, signs, encoder steps, velocities."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.emulator.unlisted.extra import Shown
from pendulum_twin.arrays import Floats

Effects = Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class Encoders:
    """Describe how finely and how cleanly the rig measures; the defaults are the INTECO rig's.

    pole_counts: counts of the pole's encoder a turn; 0 measures exactly.
    cart_step_m: step of the cart's encoder; 0 measures exactly.
    spike_rate: share of samples with a spike.
    spike_m, spike_rad: error of position and angle in a spike.
    """

    pole_counts: int = 4096
    cart_step_m: float = 57e-6
    spike_rate: float = 0.0
    spike_m: float = 0.05
    spike_rad: float = 1.0

    @property
    def pole_step_rad(self) -> float:
        """Return one step of the pole's encoder in rad; 0 when it measures exactly."""
        return 2 * math.pi / self.pole_counts if self.pole_counts else 0.0


def distort_positions(
    state: Floats, effects: Effects, stamp_s: float = 0.0
) -> tuple[float, float]:
    """Return position (m) and angle (rad) as mounting and wiring of the sensors show them.

    state: (4,) true x (m), th (rad), v (m/s), w (rad/s); th is the angle of the centre of mass.
        With an imbalance the sensor reads the angle of the pole's line.
    stamp_s: time by the stamps, for a slip.
    """
    cart, pole = float(state[0]), float(state[1])
    pole -= effects.get("pole_imbalance", {}).get("angle_rad", 0.0)
    pole += effects.get("angle_offset", {}).get("angle_rad", 0.0)
    pole += _read_ahead(pole, **effects.get("eccentric_encoder", {}))
    slip = effects.get("encoder_slip")
    if slip and stamp_s >= slip["time_s"]:
        pole += slip["angle_rad"]
    pole += pole * effects.get("angle_scale", {}).get("ratio", 0.0)
    cart += _read_pulley_ahead(cart, **effects.get("eccentric_pulley", {}))
    cart += cart * effects.get("position_scale", {}).get("ratio", 0.0)
    if "cart_sign_inverted" in effects:
        cart = -cart
    if "angle_sign_inverted" in effects:
        pole = 2 * math.pi - pole
    return cart, pole


def _read_ahead(pole_rad: float, sine_rad: float = 0.0, cosine_rad: float = 0.0) -> float:
    """Return by how much a disc that is off its axis reads ahead, rad.

    Its centre lies hypot(sine_rad, cosine_rad) of its radius beside the axis.
    """
    off = math.hypot(sine_rad, cosine_rad)
    return off * math.sin(pole_rad + math.atan2(cosine_rad, sine_rad))


def _read_pulley_ahead(
    cart_m: float, ratio: float = 0.0, period_m: float = 1.0, phase_rad: float = 0.0
) -> float:
    """Return by how much a pulley that is off its axis reads ahead, m.

    A belt of its circumference, period_m, turns it; it is off by ratio of its radius.
    """
    radius_m = period_m / math.tau
    return ratio * radius_m * math.sin(cart_m / radius_m + phase_rad)


class Sensors:
    """Measure samples that are a period apart by the rig's own clock.

    Reported velocities are the differences of the last two reported positions over the period; a
    concealed velocity filter smooths them.
    encoders: steps and spikes.
    effects: the concealed effects.
    period_s: sample period by the stamps.
    seed: of the spikes.
    more: unlisted laws of positions; they act first.
    """

    def __init__(
        self,
        encoders: Encoders,
        effects: Effects,
        period_s: float,
        seed: int = 0,
        more: Sequence[Shown] = (),
    ) -> None:
        self._encoders, self._effects, self._period_s, self._more = (
            encoders,
            effects,
            period_s,
            more,
        )
        filter_s = effects.get("velocity_filter", {}).get("time_constant_s", 0.0)
        self._keep = math.exp(-period_s / filter_s) if filter_s > 0 else 0.0
        self._random = np.random.default_rng(seed)
        self._last: Floats | None = None
        self._speed = np.zeros(2)
        self._count = 0

    def measure(self, state: Floats) -> Floats:
        """Return the reported x (m), th (rad, not wrapped), v (m/s), w (rad/s), shape (4,)."""
        positions = self._read(state, self._count * self._period_s)
        self._count += 1
        if self._encoders.spike_rate and self._random.random() < self._encoders.spike_rate:
            positions += self._random.choice([-1.0, 1.0]) * np.array(
                [self._encoders.spike_m, self._encoders.spike_rad]
            )
        if self._last is not None:
            difference = (positions - self._last) / self._period_s
            self._speed = difference + self._keep * (self._speed - difference)
        self._last = positions
        return np.concatenate([positions, self._speed])

    def _read(self, state: Floats, stamp_s: float) -> Floats:
        for law in self._more:
            state = np.array([*law(stamp_s, float(state[0]), float(state[1])), *state[2:]])
        cart, pole = distort_positions(state, self._effects, stamp_s)
        return np.array(
            [
                _round_to_step(cart, self._encoders.cart_step_m),
                _round_to_step(pole, self._encoders.pole_step_rad),
            ]
        )


def _round_to_step(value: float, step: float) -> float:
    return round(value / step) * step if step else value
