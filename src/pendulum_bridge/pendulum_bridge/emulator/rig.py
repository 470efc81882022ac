"""The emulated rig: a command in and a sample out every sample period, with MuJoCo between."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np

from pendulum_bridge.emulator.drive import make_drive
from pendulum_bridge.emulator.engine import Engine, State
from pendulum_bridge.emulator.laws import collect_laws
from pendulum_bridge.emulator.mjcf import TIMESTEP_S
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.sensors import Encoders, Sensors
from pendulum_bridge.emulator.stale_start import count_stale_samples, draw_earlier_state
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError

HANGING = (0.0, math.pi, 0.0, 0.0)


class EmulatedRig:
    """Move a rig with concealed physics; the same commands give the same bits.

    concealed: rig, effects and unlisted physics.
    rate_hz: samples a second, by the stamps.
    encoders: how finely the rig measures.
    seed: of the spikes, and of the motion that a stale start shows.
    start: (4,) true x (m), th (rad, 0 where the centre of mass is upright), v (m/s), w (rad/s).
    timestep_s: longest step of the engine; a sample period is a whole number of steps.
    Raises BadInputError for a rate that is not positive and for a rig without cart or pole.
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
        self._steps = math.ceil(self._compute_elapsed_s(0.0) / timestep_s - 1e-9)
        step_s = self._compute_elapsed_s(0.0) / self._steps
        self._engine = Engine(concealed, self._laws, step_s)
        self._drive = make_drive(effects, step_s, (rig.force_per_pwm_n or 0.0) / rig.total_mass_kg)
        self._stale = count_stale_samples(
            effects.get("stale_start", {}).get("seconds", 0.0), self.period_s
        )
        self._start, self._count = start, 0
        self._engine.put(draw_earlier_state(start, seed) if self._stale else start)
        late_s = effects.get("sensor_delay", {}).get("delay_s", 0.0)
        angle_late_s = late_s + effects.get("angle_delay", {}).get("delay_s", 0.0)
        lag_s = effects.get("angle_lag", {}).get("time_constant_s", 0.0)
        self._reporting = (
            Reporting(late_s, step_s, self._engine.state),
            Reporting(angle_late_s, step_s, self._engine.state, lag_s),
        )
        self._sensors = Sensors(encoders, effects, self.period_s, seed, self._laws.shown)
        self.sample = self._sensors.measure(self.truth)

    @property
    def truth(self) -> Floats:
        """Return the true x (m), th (rad), v (m/s), w (rad/s), shape (4,)."""
        return np.array(self._engine.state)

    @property
    def stale_samples(self) -> int:
        """Return how many of the first samples are stale: no command acts on them."""
        return self._stale

    def step(self, command: float, later: Sequence[tuple[float, float]] = ()) -> Floats:
        """Hold the command for one sample period and return the sample at its end.

        command: PWM fraction; it is clipped at the rig's limit.
        later: commands that take its place within the period: the share of the period after which
            each does, rising, and its PWM fraction.
        The sample is the measured x (m), th (rad, not wrapped), v (m/s), w (rad/s), shape (4,).
        """
        step_s = self._compute_elapsed_s(self._count * self.period_s) / self._steps
        for pwm in self._list_commands(command, later):
            self._engine.step(self._drive(pwm), step_s)
            for reporting in self._reporting:
                reporting.keep(self._engine.state)
        self._count += 1
        if self._count == self._stale:
            self._engine.put(self._start)
            for reporting in self._reporting:
                reporting.forget(self._engine.state)
        self.sample = self._sensors.measure(self._reported)
        return self.sample

    def _list_commands(self, command: float, later: Sequence[tuple[float, float]]) -> list[float]:
        """Return the PWM fraction in each step of the engine, the mean where it changes within."""
        if self._count < self._stale:
            return [0.0] * self._steps
        begins = [0.0, *(share for share, _ in later), 1.0]
        values = np.clip([command, *(pwm for _, pwm in later)], -self._limit, self._limit)
        if not later:
            return [float(values[0])] * self._steps
        sums = np.concatenate([[0.0], np.cumsum(values * np.diff(begins))])
        edges = np.linspace(0.0, 1.0, self._steps + 1)
        means: list[float] = (np.diff(np.interp(edges, begins, sums)) * self._steps).tolist()
        return means

    @property
    def _reported(self) -> Floats:
        """Return the state that the sensors read, (4,): each joint as late as its sensor is."""
        (x, _, v, _), (_, th, _, w) = (reporting.reported for reporting in self._reporting)
        return np.array([x, th, v, w])

    def _compute_elapsed_s(self, stamp_s: float) -> float:
        """Return how long (s) the sample period that is stamped with this time really lasts."""
        return self.period_s * math.prod(pace(stamp_s) for pace in self._laws.pace)


class Reporting:
    """Report states late; before the first state is due, report the first state.

    delay_s: how late; a delay between two steps of the engine mixes both states in proportion.
    step_s: the engine's step.
    angle_lag_s: time constant with which the reported angle follows the angle.
    """

    def __init__(
        self, delay_s: float, step_s: float, state: State, angle_lag_s: float = 0.0
    ) -> None:
        steps, self._fraction = divmod(delay_s / step_s, 1.0)
        self._states = deque([state], maxlen=int(steps) + 2)
        self._left = math.exp(-step_s / angle_lag_s) if angle_lag_s else 0.0
        self._angle = self._followed = state[1]
        self.forget(state)

    def keep(self, state: State) -> None:
        """Take the state after one more step."""
        x, th, v, w = state
        middle, self._angle = 0.5 * (self._angle + th), th
        self._followed = middle + self._left * (self._followed - middle) if self._left else th
        self._states.append((x, self._followed, v, w))

    def forget(self, state: State) -> None:
        """Forget all states but this state."""
        self._angle = self._followed = state[1]
        self._states.extend([state] * (self._states.maxlen or 1))

    @property
    def reported(self) -> State:
        """Return the state that is reported now."""
        x, th, v, w = (
            new + self._fraction * (old - new)
            for old, new in zip(self._states[0], self._states[1], strict=True)
        )
        return x, th, v, w
