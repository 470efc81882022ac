"""The emulated rig: command in, sample out, once a sample period; MuJoCo moves what lies between."""

from __future__ import annotations

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from pendulum_bridge.emulator.drive import chain
from pendulum_bridge.emulator.mjcf import TIMESTEP_S, Effects, build
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders, Sensors
from pendulum_twin.errors import BadInputError

Floats = NDArray[np.float64]
HANGING = (0.0, math.pi, 0.0, 0.0)
CART = 0
FINER = 32  # parts of a step in which a joint turns round: dry friction is of first order in the engine's step
STUCK = 1e-6  # m/s, rad/s: below it a joint with dry friction counts as sticking


class EmulatedRig:
    """Move a rig with concealed physics, sample period by sample period; the same commands give the same bits.

    rate_hz: samples a second. encoders: how it measures. seed: of its spikes. start: true x (m), th (rad, 0 upright),
    v (m/s), w (rad/s). Raises BadInputError when the sample period is no whole number of engine steps of at most
    timestep_s, or the rig lacks a part.
    """

    def __init__(
        self,
        concealed: Concealed,
        rate_hz: float = 100.0,
        encoders: Encoders = Encoders(),  # noqa: B008 (frozen)
        seed: int = 0,
        start: tuple[float, ...] = HANGING,
        timestep_s: float = TIMESTEP_S,
    ) -> None:
        if not rate_hz > 0:
            raise BadInputError(f"rate_hz: expected a number above 0, found {rate_hz}")
        self.period_s = 1 / rate_hz
        self._steps = math.ceil(self.period_s / timestep_s - 1e-9)
        self._step_s = self.period_s / self._steps
        self._rig, self._effects = concealed.rig, concealed.effects
        self._model = build(concealed.rig, concealed.effects, self._step_s / FINER)
        self._data = mujoco.MjData(self._model)
        self._data.qpos[:], self._data.qvel[:] = start[:2], start[2:]
        self._drive = chain(concealed.effects, self._step_s)
        self._tilt_n = _tilt_n(concealed)
        self._sensors = Sensors(encoders, concealed.effects, self.period_s, seed)
        self.sample = self._sensors.measure(self.truth)

    @property
    def truth(self) -> Floats:
        """Return the true x (m), th (rad), v (m/s), w (rad/s), shape (4,)."""
        return np.concatenate([self._data.qpos, self._data.qvel])

    def step(self, command: float) -> Floats:
        """Hold the command (PWM, clipped at the rig's limit) for one sample period; return the sample at its end.

        A sample is the measured x (m), th (rad, not wrapped), v (m/s), w (rad/s), shape (4,).
        """
        limit = self._rig.pwm_limit or math.inf
        command = min(max(command, -limit), limit)
        for _ in range(self._steps):
            self._move(self._drive(command))
        self.sample = self._sensors.measure(self.truth)
        return self.sample

    def _move(self, drive: float) -> None:
        self._data.qfrc_applied[CART] = (self._rig.force_per_pwm_n or 0.0) * drive + self._tilt_n
        parts = FINER if self._turns_round() else 1
        self._model.opt.timestep = self._step_s / parts
        for _ in range(parts):
            if "cart_stribeck_friction" in self._effects:
                self._set_stribeck(self._step_s / parts)
            mujoco.mj_step(self._model, self._data)

    def _turns_round(self) -> bool:
        """Tell whether a joint with dry friction may pass zero velocity in this step, and does not just stick."""
        speed, change = np.abs(self._data.qvel), np.abs(self._data.qacc) * self._step_s
        return bool(np.any((self._model.dof_frictionloss > 0) & (speed > STUCK) & (speed < 2 * change)))

    def _set_stribeck(self, step_s: float) -> None:
        """Set the cart's dry friction to that of the step's middle."""
        middle = float(self._data.qvel[CART] + 0.5 * step_s * self._data.qacc[CART])
        self._model.dof_frictionloss[CART] = _stribeck_n(self._effects, middle)


def _stribeck_n(effects: Effects, speed: float) -> float:
    """Return the cart's dry friction (N) at a velocity (m/s): more at rest, fading over the Stribeck velocity."""
    law = effects["cart_stribeck_friction"]
    constant = effects.get("cart_coulomb_friction", {}).get("level_n", 0.0)
    fading = math.exp(-((speed / law["velocity_m_s"]) ** 2))
    return constant + law["level_n"] + law["static_n"] * fading


def _tilt_n(concealed: Concealed) -> float:
    """Return the weight's share along the rail (N), positive the positive way.

    The angle is measured from hanging, whatever the tilt, so the pole's own weight keeps its equation; the tilt's
    second effect, the coupling's cosine turned by the same small angle, is left out.
    """
    angle = concealed.effects.get("rail_tilt", {}).get("angle_rad", 0.0)
    return concealed.rig.total_mass_kg * concealed.rig.gravity_m_s2 * math.sin(angle)
