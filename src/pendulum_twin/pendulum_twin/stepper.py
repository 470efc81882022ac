"""Step a twin sample by sample with the kernel, for the live twin and the environment."""

from __future__ import annotations

import math
from itertools import product

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.free_runs import compute_memory_offsets
from pendulum_twin.mechanics import select_kernel_code
from pendulum_twin.model import Twin
from pendulum_twin.motion import CURVES, LAW_SETS
from pendulum_twin.parameter_vector import find_active_effects, make_theta
from pendulum_twin.rail_ends import Impact, stop_cart
from pendulum_twin.sensors import (
    RATES,
    apply_sensors,
    compile_sensors,
    compute_paces,
    report_rates,
    select_reporting_effects,
    select_sensing,
    undo_sensors,
)

HANGING = (0.0, math.pi, 0.0, 0.0)
SINGLE_LANE = (0,)


def make_resting_state(twin: Twin) -> tuple[float, ...]:
    """Return the measured state of a cart in the middle and a pole that hangs at rest."""
    shown = apply_sensors(np.array([HANGING]), make_theta(twin)[None], np.zeros(1))[0]
    return tuple(float(value) + 0.0 for value in shown)  # no -0


class Stepper:
    """Advance a twin sample by sample; a run of steps gives the same bits as a free run.

    period_s: s from sample to sample, by the stamps.
    state: measured x (m), th (rad), v (m/s), w (rad/s) at the start; None: at rest.
    before: command that was held until now, which delays and lags still let through; None: the
        command of the first step, as in a free run.
    end_m: m; distance of the rail's ends from its middle, which stop the cart; infinite: no ends.
    impact: with an end of the rail in the last step; None when the cart was clear of both.
    """

    def __init__(
        self,
        twin: Twin,
        period_s: float,
        state: tuple[float, ...] | None = None,
        before: float | None = 0.0,
        end_m: float = math.inf,
    ) -> None:
        self._end_m = end_m
        self._theta, self._rest = make_theta(twin)[None], make_resting_state(twin)
        self._on = find_active_effects(self._theta)
        self._reports = select_reporting_effects(self._theta)
        self._sensing = select_sensing(self._theta)
        self._laws, self._dry, self._measured = select_kernel_code(self._theta)
        self._period_s = period_s
        self._sub = kernel.count_substeps(period_s)
        self._h = period_s / self._sub  # by the stamps; really it is pace times as long
        self._pace = float(compute_paces(self._theta)[0])
        self._offsets = compute_memory_offsets(self._h * self._pace)
        self._command = np.empty(1)
        self._drive = np.empty((1, self._sub))
        self._out = np.empty((1, 2, 4))  # the true state before and after the last step
        self._zero = np.zeros(1, dtype=np.int64)
        self.reset(state, before)

    def reset(self, state: tuple[float, ...] | None = None, before: float | None = 0.0) -> None:
        """Start again from a measured state; of earlier commands only `before` is left."""
        state = self._rest if state is None else state
        self._memory = np.zeros(self._offsets[-1])
        self._path_memory = np.zeros((1, PATH_SIZE))
        self._steps = 0
        self.impact: Impact | None = None
        if before is not None:
            self._command[0] = before
            self._filter(self._drive[0, :1])
        self._true = undo_sensors(np.array([state], dtype=np.float64), self._theta, np.zeros(1))
        self._shown = np.array([state], dtype=np.float64)

    @property
    def state(self) -> Floats:
        """Return the measured state now, shape (4,): x, th, v, w."""
        return self._shown[0].copy()

    def step(self, command: float) -> Floats:
        """Hold the command for a sample period; return the measured state after it, (4,)."""
        self._command[0] = command
        self._filter(self._drive[0])
        kernel.integrate_lanes(
            SINGLE_LANE,
            self._laws,
            self._dry,
            self._measured,
            self._drive,
            self._zero,
            self._zero,
            np.array([self._steps]),
            self._true,
            self._path_memory,
            self._theta,
            self._zero,
            self._h,
            self._sub,
            self._out,
        )
        self._steps += self._sub
        self._true[:] = self._out[:, 1]
        self.impact = stop_cart(self._true[0], self._theta[0], self._end_m)
        t = np.array([self._steps // self._sub * self._period_s])
        shown = apply_sensors(self._true, self._theta, t, sensing=self._sensing)
        if self._reports:
            shown[:, RATES] = report_rates(
                shown[:, RATES], self._shown[:, RATES], self._theta, self._reports, self._period_s
            )
        self._shown = shown
        return self.state

    def _filter(self, drive: Floats) -> None:
        """Fill drive (substeps,) with the command after command and drive."""
        h = self._h * self._pace
        kernel.filter_command(
            self._command,
            self._memory,
            self._offsets,
            h,
            len(drive),
            self._steps,
            self._theta[0],
            self._on,
            drive,
        )


def compile_for_any_effect(twin: Twin, period_s: float) -> None:
    """Compile what a stepper of any twin can need, so that no run stands still to compile.

    Measured hysteresis is rare, and is compiled for a twin that has it.
    """
    compile_sensors()
    stepper = Stepper(twin, period_s)
    stepper.step(0.0)
    for stepper._laws, stepper._measured in product(LAW_SETS, (None, CURVES)):
        stepper.step(0.0)
