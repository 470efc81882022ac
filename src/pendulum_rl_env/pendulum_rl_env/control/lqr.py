"""Balancing upright: the twin's own map from command to command, linearised there, and its linear-quadratic regulator.

What the drive remembers (delay, lag) is told by past drives, so the regulator's state holds these
too; and the sum of x, for what the twin says wrongly of angle and forces would keep the cart
beside the middle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are
from scipy.optimize import brentq

from pendulum_rl_env.control.rig_forces import compute_drive, compute_forces
from pendulum_rl_env.kernel_transport import count_samples
from pendulum_twin import lanes
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

Floats = NDArray[np.float64]

# Effects that have a derivative at rest. The others are undone (see `static_drive`), compensated,
# or left to feedback.
SMOOTH = (
    "input_delay",
    "motor_lag",
    "cart_quadratic_drag",
    "rail_tilt",
    "rail_spring",
    "pole_quadratic_drag",
    "pole_spring",
    "sensor_delay",
    "sample_period_error",
)
DIFFERENCE_STEP = 1e-4  # of a state, and of the drive, for derivatives
FORGOTTEN_SHARE = 1e-3  # of the largest effect of a past drive: what is less is forgotten
MOST_PERIODS = 40  # periods that are remembered


@dataclass(frozen=True)
class Upright:
    """Hold where the pole balances: true angle (rad) and the drive that it takes in the middle of the rail."""

    angle_rad: float
    drive: float

    @property
    def state(self) -> Floats:
        """Return the true state x, th, v, w."""
        return np.array([0.0, self.angle_rad, 0.0, 0.0])


@dataclass(frozen=True)
class LinearMap:
    """Hold the map from command to command, of distances from `Upright`.

    state: (4, 4). drive: (n + 1, 4), the effect of this period's drive and of those n before it.
    """

    state: Floats
    drive: Floats

    @property
    def augmented(self) -> tuple[Floats, Floats]:
        """Return A (5 + n, 5 + n) and B (5 + n, 1) of x, th, v, w, the sum of x, and the last n drives, the newest first."""
        n = len(self.drive) - 1
        a, b = np.zeros((5 + n, 5 + n)), np.zeros((5 + n, 1))
        a[:4, :4], a[:4, 5:], b[:4, 0] = self.state, self.drive[1:].T, self.drive[0]
        a[4, [0, 4]] = 1.0
        if n:
            a[6:, 5:-1], b[5, 0] = np.eye(n - 1), 1.0
        return a, b


def keep_smooth_effects(twin: Twin) -> Twin:
    """Return the twin with what can be linearised: no dry friction, no steps of the command, exact sensors."""
    return Twin(
        twin.name,
        twin.rig,
        {name: values for name, values in twin.effects.items() if name in SMOOTH},
    )


def find_upright(twin: Twin, turn: int = 0) -> Upright:
    """Return where a twin balances near the angle 2 pi turn; raise BadInputError when it does so nowhere.

    Where gravity and springs leave no torque on the pole; the drive holds what then pushes the
    cart.
    """
    theta = make_theta(keep_smooth_effects(twin))

    def torque(angle: float) -> float:
        return compute_forces(np.array([0.0, angle, 0.0, 0.0]), theta).turn

    middle = 2 * math.pi * turn
    if not torque(middle - 1.0) < 0.0 < torque(middle + 1.0):
        raise BadInputError(
            f"{twin.name}: expected a pole that falls when it is left alone, found one that does not"
        )
    angle = float(brentq(torque, middle - 1.0, middle + 1.0))
    return Upright(angle, compute_drive(0.0, 0.0, np.array([0.0, angle, 0.0, 0.0]), theta))


def linearise(twin: Twin, at: Upright, step_s: float) -> LinearMap:
    """Return the map of the twin's smooth part over periods of step_s, by differences through the kernel."""
    period = _Period(keep_smooth_effects(twin), at, step_s)
    state = np.empty((4, 4))
    for k in range(4):
        aside = np.zeros(4)
        aside[k] = DIFFERENCE_STEP
        state[:, k] = (period.run(aside, [0.0])[0] - period.run(-aside, [0.0])[0]) / (
            2 * DIFFERENCE_STEP
        )
    up, down = (
        period.run(np.zeros(4), [way * DIFFERENCE_STEP, *[0.0] * MOST_PERIODS])
        for way in (1.0, -1.0)
    )
    drive = (up - down) / (2 * DIFFERENCE_STEP)
    kept = np.flatnonzero(
        (np.abs(drive) > FORGOTTEN_SHARE * np.abs(drive).max(axis=0)).any(axis=1)
    )
    return LinearMap(state, drive[: kept[-1] + 1])


class _Period:
    """Run a twin for single periods from near a state; only what the drive remembers goes on from one to the next."""

    def __init__(self, twin: Twin, at: Upright, step_s: float) -> None:
        self._at = at
        self._timing = lanes.make_timing(step_s, count_samples(step_s))
        self._kinds = lanes.make_kinds([twin], self._timing)
        self._lanes = lanes.make_lanes(self._kinds, self._timing, 1)
        self._code = lanes.select_lane_code(self._kinds, 1)

    def run(self, aside: Floats, drives: list[float]) -> Floats:
        """Return the distances from rest at the end of every period, (periods, 4); each begins this far aside of it."""
        lanes.begin_lane_from_python(self._kinds, self._lanes, self._timing, 0, 0, lanes.AT_REST)
        for _ in range(MOST_PERIODS):  # for as long as the drive remembers, it was this
            self._hold(np.zeros(4), 0.0)
        return np.array([self._hold(aside, drive) for drive in drives])

    def _hold(self, aside: Floats, drive: float) -> Floats:
        self._lanes.true[0] = self._at.state + aside
        held = np.array([self._at.drive + drive])
        lanes.advance_lanes_from_python(self._code, self._kinds, self._lanes, self._timing, held)
        return self._lanes.true[0] - self._at.state


def design_regulator(linear: LinearMap, weights: Sequence[float], effort: float) -> Floats:
    """Return the gains (5 + n,) of drive = -gains (x, th, v, w, sum of x, past drives), all as distances from `Upright`.

    weights: of the squares of x, th, v, w and the sum of x; effort: of that of the drive. Raises
    BadInputError when there is no regulator.
    """
    a, b = linear.augmented
    q = np.diag([*weights, *[0.0] * (len(a) - 5)])
    r = np.array([[effort]])
    try:
        p = solve_discrete_are(a, b, q, r)
        gains: Floats = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a)[0]
    except (np.linalg.LinAlgError, ValueError) as error:
        raise BadInputError(
            f"expected a rig that its drive can balance, found none: {error}"
        ) from error
    return gains
