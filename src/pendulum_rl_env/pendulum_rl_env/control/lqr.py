"""Balance upright by a linear-quadratic regulator on the twin's own linearised map.

The map goes from command to command. Past drives stand for what the drive remembers (delay, lag),
so the regulator's state holds them, too. It also holds the sum of x: an error of the twin in angle
or forces would keep the cart beside the middle.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_discrete_are
from scipy.optimize import brentq

from pendulum_rl_env.control.rig_forces import compute_drive, compute_forces
from pendulum_rl_env.kernel_transport import count_samples
from pendulum_twin import lanes
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

DIFFERENCE_STEP = 1e-4  # of a state (m, rad, m/s, rad/s) and of the drive, for derivatives
FORGOTTEN_SHARE = 1e-3  # of the largest effect of a past drive: what is less is forgotten
MOST_PERIODS = 40  # that are remembered


@dataclass(frozen=True)
class Upright:
    """Hold where the pole balances.

    angle_rad: true angle.
    drive: 1; holds the cart there in the middle of the rail.
    """

    angle_rad: float
    drive: float

    @property
    def state(self) -> Floats:
        """Return the true state x, th, v, w."""
        return np.array([0.0, self.angle_rad, 0.0, 0.0])


@dataclass(frozen=True)
class LinearMap:
    """Hold the map from command to command, of distances from `Upright`.

    state: (4, 4) effect of the state x, th, v, w.
    drive: (n + 1, 4) effect of this period's drive and of the n before it.
    """

    state: Floats
    drive: Floats

    @property
    def augmented(self) -> tuple[Floats, Floats]:
        """Return A (5 + n, 5 + n) and B (5 + n, 1).

        Of x, th, v, w, the sum of x, and the last n drives, the newest first.
        """
        n = len(self.drive) - 1
        a, b = np.zeros((5 + n, 5 + n)), np.zeros((5 + n, 1))
        a[:4, :4], a[:4, 5:], b[:4, 0] = self.state, self.drive[1:].T, self.drive[0]
        a[4, [0, 4]] = 1.0
        if n:
            a[6:, 5:-1], b[5, 0] = np.eye(n - 1), 1.0
        return a, b


def keep_smooth_effects(twin: Twin) -> Twin:
    """Return the twin with the effects that a linear model holds (`Effect.smooth`).

    The controller undoes or compensates the others, or leaves them to feedback.
    """
    kept = {name: values for name, values in twin.effects.items() if BY_NAME[name].smooth}
    return Twin(twin.name, twin.rig, kept)


def find_upright(twin: Twin, turn: int = 0) -> Upright:
    """Return where a twin balances near the angle 2 pi turn.

    Gravity, springs and measured laws leave no torque on the pole there; the drive holds the cart
    against its forces. Raises BadInputError when the pole does not fall from there.
    """
    lasting = twin.drop_timed_effects()
    theta = make_theta(replace(lasting, effects=keep_smooth_effects(lasting).effects))

    def compute_torque(angle: float) -> float:
        return compute_forces(np.array([0.0, angle, 0.0, 0.0]), theta).turn

    middle = 2 * math.pi * turn
    if not compute_torque(middle - 1.0) < 0.0 < compute_torque(middle + 1.0):
        raise BadInputError(
            f"{twin.name}: expected a pole that falls when it is left alone, found a pole that "
            "does not"
        )
    angle = float(brentq(compute_torque, middle - 1.0, middle + 1.0))
    return Upright(angle, compute_drive(0.0, 0.0, np.array([0.0, angle, 0.0, 0.0]), theta))


def linearise(twin: Twin, at: Upright, step_s: float) -> LinearMap:
    """Return the map of the twin's smooth part over periods of step_s, by central differences."""
    period = _Period(keep_smooth_effects(twin), at, step_s)
    state = np.empty((4, 4))
    for k, aside in enumerate(DIFFERENCE_STEP * np.eye(4)):
        plus, minus = period.run(aside, [0.0])[0], period.run(-aside, [0.0])[0]
        state[:, k] = (plus - minus) / (2 * DIFFERENCE_STEP)
    pause = [0.0] * MOST_PERIODS
    plus = period.run(np.zeros(4), [DIFFERENCE_STEP, *pause])
    minus = period.run(np.zeros(4), [-DIFFERENCE_STEP, *pause])
    drive = (plus - minus) / (2 * DIFFERENCE_STEP)
    is_felt = np.abs(drive) > FORGOTTEN_SHARE * np.abs(drive).max(axis=0)
    return LinearMap(state, drive[: np.flatnonzero(is_felt.any(axis=1))[-1] + 1])


class _Period:
    """Run a twin for single periods from near a state; only the drive's memory carries over."""

    def __init__(self, twin: Twin, at: Upright, step_s: float) -> None:
        self._at = at
        self._timing = lanes.make_timing(step_s, count_samples(step_s))
        self._kinds = lanes.make_kinds([twin], self._timing)
        self._lanes = lanes.make_lanes(self._kinds, self._timing, 1)
        self._code = lanes.select_lane_code(self._kinds, 1)

    def run(self, aside: Floats, drives: list[float]) -> Floats:
        """Return the distances from `Upright` at the end of every period, (periods, 4).

        aside: (4,) distance from `Upright` at which every period begins.
        drives: distance of each period's drive from that of `Upright`.
        """
        lanes.begin_lane_from_python(self._kinds, self._lanes, self._timing, 0, 0, lanes.AT_REST)
        for _ in range(MOST_PERIODS):  # until the drive remembers nothing else
            self._hold(np.zeros(4), 0.0)
        return np.array([self._hold(aside, drive) for drive in drives])

    def _hold(self, aside: Floats, drive: float) -> Floats:
        self._lanes.true[0] = self._at.state + aside
        command = np.array([self._at.drive + drive])
        lanes.advance_lanes_from_python(
            self._code, self._kinds, self._lanes, self._timing, command
        )
        return self._lanes.true[0] - self._at.state


def design_regulator(linear: LinearMap, weights: Sequence[float], effort: float) -> Floats:
    """Return the gains (5 + n,) of drive = -gains (x, th, v, w, sum of x, past drives).

    All are distances from `Upright`.

    linear: the map to balance.
    weights: (5,) of the squares of x, th, v, w and the sum of x.
    effort: weight of the square of the drive.

    Raises BadInputError when no regulator balances the map.
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
