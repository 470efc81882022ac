"""One short window of the rig beside the twin: what is off, and how the twin's run would change with each thing.

The twin runs freely through the window from a start that is smoothed out of the samples and then
refined on the window itself. All derivatives are differences between runs of the same kernel, at
sizes that matter.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from pendulum_bridge.watch.signatures import (
    PROBE,
    Signature,
    full_force_n,
    full_torque_n_m,
    probes,
)
from pendulum_bridge.watch.stream import History
from pendulum_bridge.watch.window_runs import WindowRuns, runs_away, solved, spikes
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import (
    COUPLING,
    FORCE_PER_PWM,
    GRAVITY,
    INERTIA,
    MASS,
    SLOTS,
    make_theta,
)
from pendulum_twin.signals import Signals

WINDOW_S = 0.5
LEAD_S = 2.0  # of commands before a window, for what the drive remembers
LEAST_LEAD_S = 0.3
SMOOTH_S = 0.08  # to either side of a window's start, spanned by the cubic that smooths it
PUSH_S = 0.05  # between pushes that stand for what the twin leaves open
NEAR_END_M = 0.02  # of the rail's end: what happens there is no part of the twin
LEAST_SAMPLES = 0.6  # of a window
IDLE = 0.02  # of the largest acceleration: below it nothing counts as active
PUSHED = 0.03  # of the activity: size of the pushes from which their effect is computed
TILT = SLOTS["rail_tilt"].start  # a rail's tilt times g is an acceleration of the cart
OF_SAMPLE = (
    0,
    1,
)  # position of cart and pole in a state (x, th, v, w); their rates stand 2 further


@dataclass(frozen=True)
class Reading:
    """Hold one window: rows are its good samples, cart's first, then the pole's.

    slot, end_ns: its last slot and that one's stamp. start: (4,) measured, from which the twin
    ran. measured: (rows,) m and rad. off: (rows,) measured minus twin. joint, at: (rows,) 0 cart
    or 1 pole, and which sample of the window. by_start: (rows, states) change with the start.
    by_signature: (rows, signatures) change with a signature's size, in its unit.
    by_push: (rows, pushes) change with what the twin leaves open: per unit of an acceleration of
    push_joint (pushes,) times felt_s (pushes,). activity: (2,) how large accelerations are in this
    window, m/s^2 and rad/s^2. moves: whether anything moves.
    """

    slot: int
    end_ns: int
    start: Floats
    measured: Floats
    off: Floats
    joint: Ints
    at: Ints
    by_start: Floats
    by_signature: Floats
    by_push: Floats
    push_joint: Ints
    felt_s: Floats
    activity: Floats
    moves: bool


class Reader:
    """Read windows of one rig with one twin; bank: what may change about it."""

    def __init__(self, twin: Twin, bank: tuple[Signature, ...], period_s: float) -> None:
        self._theta = probes(make_theta(twin), bank)
        self._sizes = PROBE * np.array([signature.worth for signature in bank])
        self._period_s = period_s
        self.samples = round(WINDOW_S / period_s)
        self.least = self.samples + round(LEAST_LEAD_S / period_s)
        self.slots = self.samples + round(LEAD_S / period_s)
        self._smooth = max(4, round(SMOOTH_S / period_s))
        self._spacing = max(1, round(PUSH_S / period_s))
        self._winds = "pole_spring" in twin.effects
        rig = twin.rig
        self._joints = np.flatnonzero([rig.has_cart, rig.has_pole])
        self._end_m = (rig.rail_half_length_m or np.inf) - NEAR_END_M
        dry = [values for name, values in twin.effects.items() if name.startswith("cart_")]
        self._dry_n = sum(
            values.get(key, 0.0) for values in dry for key in ("level_n", "static_n")
        )
        push = full_force_n(rig) / rig.total_mass_kg
        turn = full_torque_n_m(rig)
        if rig.has_pole and rig.has_cart:
            turn += rig.total_mass_kg * (rig.com_distance_m or 0.0) * push
        self._idle = IDLE * np.array([push, turn / (rig.pole_inertia_kg_m2 or 1.0)])

    def changed(self, signature: Signature, size: float) -> Reader:
        """Return a reader whose twin has changed as a signature says, by a size in its unit."""
        other = copy(self)
        other._theta = self._theta.copy()
        other._theta[:, signature.theta] += size * signature.per_unit
        return other

    def read(self, history: History, sensor: Floats) -> Reading | None:
        """Return the newest window; None when it lacks samples, the cart was at the rail's end, or a run runs away.

        sensor: (2,) deviation of a sample of cart (m) and pole (rad), roughly.
        """
        first = len(history.command) - 1 - self.samples
        positions = self._unwound(history.positions, first)
        window = positions[first:]
        good = np.isfinite(window)
        if first < self.least - self.samples or np.any(
            good[:, self._joints].mean(axis=0) < LEAST_SAMPLES
        ):
            return None
        if 0 in self._joints and np.nanmax(np.abs(window[:, 0])) > self._end_m:
            return None
        start = self._start(positions, first)
        if start is None:
            return None
        joint, at = np.nonzero(good.T & np.isin(np.arange(2), self._joints)[:, None])
        run = WindowRuns(self._signals(history.command), self._theta, first, joint, at)
        return self._read(history, window.T[joint, at], start, run, sensor)

    def _read(
        self, history: History, measured: Floats, start: Floats, run: WindowRuns, sensor: Floats
    ) -> Reading | None:
        states, steps = self._steps(sensor)
        plain = np.zeros(1 + len(states), dtype=np.int64)
        shown, _ = run.shown(plain, self._varied(start, states, steps), self.samples + 1)
        start = start.copy()
        start[states] += steps * solved(
            (shown[1:] - shown[0]).T, measured - shown[0], sensor[run.joint]
        )
        sets = np.concatenate([plain, np.arange(1, len(self._theta))])
        starts = np.concatenate(
            [self._varied(start, states, steps), np.repeat(start[None], len(self._sizes), axis=0)]
        )
        shown, path = run.shown(sets, starts, self.samples + 1)
        off, changed = measured - shown[0], (shown[1:] - shown[0]).T
        activity = self._activity(path[0], run)
        by_push, push_joint, felt_s = self._pushed(run, path[0], shown[0], activity)
        if runs_away(changed) or runs_away(by_push):
            return None
        good = ~spikes(off, run.joint, run.at, sensor)
        return Reading(
            history.slot,
            history.end_ns,
            start,
            measured[good],
            off[good],
            run.joint[good],
            run.at[good],
            changed[good, : len(states)] / steps,
            changed[good, len(states) :] / self._sizes,
            by_push[good],
            push_joint,
            felt_s,
            activity,
            bool(
                np.any(
                    np.ptp(path[0][:, OF_SAMPLE], axis=0)[self._joints] > 10 * sensor[self._joints]
                )
            ),
        )

    def sketched(
        self, history: History, reading: Reading, sensor: Floats, theta: Floats
    ) -> list[Reading | None]:
        """Return what the window's reading would be with other twins, (twins, SIZE), in rough: all else is as it was read.

        Their starts are varied, but not refined, and they are not pushed; by_signature stays that
        of the twin itself. None for a twin that runs away.
        """
        states, steps = self._steps(sensor)
        starts = self._varied(reading.start, states, steps)
        first = len(history.command) - 1 - self.samples
        run = WindowRuns(self._signals(history.command), theta, first, reading.joint, reading.at)
        sets = np.repeat(np.arange(len(theta)), len(starts))
        shown, _ = run.shown(sets, np.tile(starts, (len(theta), 1)), self.samples + 1)
        shown = shown.reshape(len(theta), len(starts), -1)
        return [
            None
            if runs_away(each)
            else replace(
                reading,
                off=reading.measured - each[0],
                by_start=((each[1:] - each[0]) / steps[:, None]).T,
            )
            for each in shown
        ]

    def _steps(self, sensor: Floats) -> tuple[Ints, Floats]:
        """Return which states a start has, and the steps in which they are varied."""
        rate = sensor / (self._smooth * self._period_s) + 0.005 * self._idle / IDLE * WINDOW_S
        states = np.concatenate([self._joints, self._joints + 2])
        return states, np.concatenate([sensor, rate])[states]

    def theta(self, signature: Signature, size: float) -> Floats:
        """Return the words of the twin changed as a signature says, (SIZE,)."""
        theta = self._theta[0].copy()
        theta[list(signature.theta)] += size * signature.per_unit
        return theta

    def _unwound(self, positions: Floats, first: int) -> Floats:
        """Return positions with the pole's whole turns taken off where the window begins; a twin's spring counts them."""
        angles = positions[first:, 1]
        angles = angles[np.isfinite(angles)]
        if self._winds or not len(angles):
            return positions
        return positions - [0.0, 2 * np.pi * np.floor(angles[0] / (2 * np.pi))]

    def _varied(self, start: Floats, states: Ints, steps: Floats) -> Floats:
        """Return the start, and below it one with each of its states moved by its step."""
        starts = np.repeat(start[None], 1 + len(states), axis=0)
        starts[1 + np.arange(len(states)), states] += steps
        return starts

    def _pushed(
        self, run: WindowRuns, path: Floats, shown: Floats, activity: Floats
    ) -> tuple[Floats, Ints, Floats]:
        """Return the change of the rows with each push, the pushes' joints, and the time for which each is felt.

        The cart is pushed by forces that begin at one time and last, each way: what sticks answers
        to nothing shorter. The pole's rate is changed at once.
        """
        times = np.arange(0, self.samples, self._spacing)
        forced = np.repeat(times[::2], 2) if 0 in self._joints else times[:0]
        turned = times[1:] if 1 in self._joints else times[:0]
        when = np.concatenate([forced, turned])
        way = np.resize([1.0, -1.0], len(forced))
        theta = np.repeat(self._theta[:1], len(when), axis=0)
        theta[: len(forced), TILT] += way * PUSHED * activity[0] / max(theta[0, GRAVITY], 0.1)
        sizes = np.concatenate(
            [way * PUSHED * activity[0], np.full(len(turned), PUSHED * activity[1] * PUSH_S)]
        )
        starts = path[when]
        starts[len(forced) :, 3] += sizes[len(forced) :]
        later = run.later(when, starts, theta, self.samples + 1)
        since = run.at[None] - when[:, None]
        moved = (
            later[np.arange(len(when))[:, None], np.maximum(since, 0), run.joint[None]]
            - shown[None]
        )
        by_push = (np.where(since > 0, moved, 0.0) / sizes[:, None]).T
        both_ways = np.where(np.arange(len(when)) < len(forced), np.sqrt(0.5), PUSH_S)
        return by_push, (np.arange(len(when)) >= len(forced)).astype(np.int64), both_ways

    def _activity(self, path: Floats, run: WindowRuns) -> Floats:
        """Return the root mean square of what accelerates each joint: all that pushes the cart, even if it sticks."""
        a, b = np.sqrt(np.mean((np.diff(path[:, 2:], axis=0) / self._period_s) ** 2, axis=0))
        theta = self._theta[0]
        command = np.sqrt(np.mean(run.window_command(self.samples) ** 2))
        swing = theta[COUPLING] * (b + np.sqrt(np.mean(path[:, 3] ** 4)))
        cart = a + (theta[FORCE_PER_PWM] * command + swing + self._dry_n) / theta[MASS]
        return np.array([cart, b + theta[COUPLING] / theta[INERTIA] * a]) + self._idle

    def _start(self, positions: Floats, first: int) -> Floats | None:
        """Return the state at the window's start by a cubic through the samples around it; None where too many are lost."""
        begin = max(0, first - self._smooth)
        around = positions[begin : first + self._smooth + 1]
        t = (np.arange(begin, begin + len(around)) - first) * self._period_s
        start = np.array([0.0, np.pi, 0.0, 0.0])
        for k in self._joints:
            good = np.isfinite(around[:, k])
            if good.sum() < 6:
                return None
            fit = np.polynomial.polynomial.polyfit(t[good], around[good, k], 3)
            start[k], start[2 + k] = fit[0], fit[1]
        return start

    def _signals(self, command: Floats) -> Signals:
        """Return the commands as the kernel takes them, held on beyond their end for runs that start late."""
        padded = np.concatenate([command, np.full(self.samples + 1, command[-1])])
        blank, every = np.zeros(len(padded)), np.ones(len(padded), dtype=bool)
        return Signals(self._period_s, padded, blank, blank, every, every)
