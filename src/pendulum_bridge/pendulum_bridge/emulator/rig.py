"""The emulated rig: command in, sample out, once a sample period; MuJoCo moves what lies between."""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from pendulum_bridge.emulator.drive import make_drive
from pendulum_bridge.emulator.engine import Engine, State
from pendulum_bridge.emulator.laws import collect_laws
from pendulum_bridge.emulator.mjcf import TIMESTEP_S
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders, Sensors
from pendulum_bridge.emulator.stale_start import count_stale_samples, draw_earlier_state
from pendulum_twin.errors import BadInputError

Floats = NDArray[np.float64]
HANGING = (0.0, math.pi, 0.0, 0.0)


class EmulatedRig:
    """Move a rig with concealed physics, sample period by sample period; the same commands give the same bits.

    rate_hz: samples a second, by the stamps. encoders: how it measures. seed: of its spikes, and
    of what a stale start shows. start: true x (m), th (rad, 0 where the centre of mass is
    upright), v (m/s), w (rad/s). timestep_s: longest step of the engine; each period is a whole
    number of steps. Raises BadInputError for a rate that is none, and for a rig that lacks a part.
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
        rig, effects, self._laws = concealed.rig, concealed.effects, collect_laws(concealed)
        self._limit = rig.pwm_limit or math.inf
        self._steps = math.ceil(self._passing_s(0.0) / timestep_s - 1e-9)
        step_s = self._passing_s(0.0) / self._steps
        self._engine = Engine(concealed, self._laws, step_s)
        self._drive = make_drive(effects, step_s, (rig.force_per_pwm_n or 0.0) / rig.total_mass_kg)
        self._stale = count_stale_samples(
            effects.get("stale_start", {}).get("seconds", 0.0), self.period_s
        )
        self._start, self._count = start, 0
        self._engine.put(draw_earlier_state(start, seed) if self._stale else start)
        self._reporting = Reporting(
            effects.get("sensor_delay", {}).get("delay_s", 0.0), step_s, self._engine.state
        )
        self._sensors = Sensors(encoders, effects, self.period_s, seed, self._laws.shown)
        self.sample = self._sensors.measure(self.truth)

    @property
    def truth(self) -> Floats:
        """Return the true x (m), th (rad), v (m/s), w (rad/s), shape (4,)."""
        return np.array(self._engine.state)

    @property
    def stale_samples(self) -> int:
        """Return how many samples from the first on do not belong to the run: commands do not act on them."""
        return self._stale

    def step(self, command: float) -> Floats:
        """Hold the command (PWM, clipped at the rig's limit) for one sample period; return the sample at its end.

        A sample is the measured x (m), th (rad, not wrapped), v (m/s), w (rad/s), shape (4,).
        """
        command = (
            min(max(command, -self._limit), self._limit) if self._count >= self._stale else 0.0
        )
        step_s = self._passing_s(self._count * self.period_s) / self._steps
        for _ in range(self._steps):
            self._engine.step(self._drive(command), step_s)
            self._reporting.keep(self._engine.state)
        self._count += 1
        if self._count == self._stale:
            self._engine.put(self._start)
            self._reporting.forget(self._engine.state)
        self.sample = self._sensors.measure(np.array(self._reporting.reported))
        return self.sample

    def _passing_s(self, stamp_s: float) -> float:
        """Return how long the sample period that is stamped with this time really lasts."""
        return self.period_s * math.prod(pace(stamp_s) for pace in self._laws.pace)


class Reporting:
    """Report states some time late; before the first, the first. Between two steps of the engine, in proportion."""

    def __init__(self, delay_s: float, step_s: float, state: State) -> None:
        whole, self._part = divmod(delay_s / step_s, 1.0)
        self._states = deque([state], maxlen=int(whole) + 2)
        self.forget(state)

    def keep(self, state: State) -> None:
        """Take the state after one more step."""
        self._states.append(state)

    def forget(self, state: State) -> None:
        """Know only this state from now on."""
        self._states.extend([state] * (self._states.maxlen or 1))

    @property
    def reported(self) -> State:
        """Return the state that is reported now."""
        x, th, v, w = (
            new + self._part * (old - new)
            for old, new in zip(self._states[0], self._states[1], strict=True)
        )
        return x, th, v, w
