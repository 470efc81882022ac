"""Read a short window of the rig beside the twin: errors, and their derivatives.

The twin runs freely through the window. Its start is smoothed out of the samples and refined on
the window itself. All derivatives are differences between runs of the same kernel, at sizes that
matter.
"""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, replace

import numpy as np

from pendulum_bridge.watch.signatures import (
    PROBE_SIZE,
    Signature,
    compute_full_force_n,
    compute_full_torque_n_m,
    find_steady_push,
    make_probes,
)
from pendulum_bridge.watch.stream import History
from pendulum_bridge.watch.window_runs import (
    WindowRuns,
    find_spikes,
    has_run_away,
    solve_least_squares,
)
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form, Place
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import (
    COUPLING,
    FORCE_PER_PWM,
    INERTIA,
    MASS,
    make_theta,
)
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Signals

WINDOW_S = 0.5
LEAD_S = 2.0  # of commands before a window, for what the drive remembers
LEAST_LEAD_S = 0.3
SMOOTHING_S = 0.08  # to either side of a window's start, for the cubic that smooths it
PUSH_SPACING_S = 0.05  # between the pushes that stand for what the twin leaves open
NEAR_END_M = 0.02  # of the rail's end: what happens there is no part of the twin
LEAST_SAMPLE_SHARE = 0.6  # of a window's samples
LEAST_START_SAMPLES = 6  # for the cubic
IDLE_SHARE = 0.02  # of the largest acceleration: below it nothing counts as active
PUSH_SHARE = 0.03  # of the activity: size of the pushes from which their effect is computed
MOTION_FACTOR = 10.0  # times a sensor's deviation: range of a joint that moves
POSITIONS = (0, 1)  # of cart and pole in a state (x, th, v, w); their rates stand 2 further


@dataclass(frozen=True)
class Reading:
    """Hold a window; rows are its good samples, the cart's first, then the pole's.

    slot: its last slot.
    end_ns: ns; stamp of its last slot.
    start: (4,) measured state from which the twin ran.
    measured: (rows,) m and rad.
    off: (rows,) measured minus twin.
    joint: (rows,) 0 cart, 1 pole.
    at: (rows,) sample of the window.
    by_start: (rows, states) derivative by the start.
    by_signature: (rows, signatures) derivative by a signature's size, in its unit.
    by_push: (rows, pushes) derivative by an acceleration of push_joint that the twin leaves open,
        times felt_s.
    push_joint: (pushes,) 0 cart, 1 pole.
    felt_s: (pushes,) s; how long a push is felt.
    activity: (2,) root mean square acceleration in this window, m/s^2 and rad/s^2.
    moves: whether anything moves.
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
    """Read windows of a rig with a twin.

    twin: the rig as it is believed to be.
    bank: what may change about it.
    period_s: s; from sample to sample.
    samples: of a window.
    least: slots that a window needs with its lead.
    slots: of a window with its whole lead.
    """

    def __init__(self, twin: Twin, bank: tuple[Signature, ...], period_s: float) -> None:
        rig = twin.rig
        self._theta = make_probes(make_theta(twin), bank)
        self._sizes = PROBE_SIZE * np.array([signature.worth for signature in bank])
        self._period_s = period_s
        self.samples = round(WINDOW_S / period_s)
        self.least = self.samples + round(LEAST_LEAD_S / period_s)
        self.slots = self.samples + round(LEAD_S / period_s)
        self._smooth = max(4, round(SMOOTHING_S / period_s))
        self._spacing = max(1, round(PUSH_SPACING_S / period_s))
        self._winds = any(BY_NAME[name].winds for name in twin.effects)
        self._joints = np.flatnonzero([rig.has_cart, rig.has_pole])
        self._end_m = (rig.rail_half_length_m or np.inf) - NEAR_END_M
        self._dry_n = _sum_dry_friction_n(twin)
        self._idle = IDLE_SHARE * _compute_full_accelerations(rig)

    def make_changed(self, signature: Signature, size: float) -> Reader:
        """Return a reader whose twin has changed by a signature's size, in its unit."""
        reader = copy(self)
        reader._theta = self._theta.copy()
        reader._theta[:, signature.theta] += size * signature.per_unit
        return reader

    def read(self, history: History, sensor: Floats) -> Reading | None:
        """Return the newest window.

        None when samples are missing, the cart was at the rail's end, or a run runs away.

        sensor: (2,) standard deviation of a sample of cart (m) and pole (rad), roughly.
        """
        first = len(history.command) - 1 - self.samples
        if first < self.least - self.samples:
            return None
        positions = self._unwind(history.positions, first)
        window = positions[first:]
        good = np.isfinite(window)
        if np.any(good[:, self._joints].mean(axis=0) < LEAST_SAMPLE_SHARE):
            return None
        if 0 in self._joints and np.nanmax(np.abs(window[:, 0])) > self._end_m:
            return None
        start = self._smooth_start(positions, first)
        if start is None:
            return None
        joint, at = np.nonzero(good.T & np.isin(np.arange(2), self._joints)[:, None])
        runs = WindowRuns(self._make_signals(history.command), self._theta, first, joint, at)
        return self._read(history, window.T[joint, at], start, runs, sensor)

    def _read(
        self, history: History, measured: Floats, start: Floats, runs: WindowRuns, sensor: Floats
    ) -> Reading | None:
        states, steps = self._choose_steps(sensor)
        start = self._refine_start(measured, start, runs, sensor)
        plain = np.zeros(1 + len(states), dtype=np.int64)
        sets = np.concatenate([plain, np.arange(1, len(self._theta))])
        varied = self._vary(start, states, steps)
        starts = np.concatenate([varied, np.repeat(start[None], len(self._sizes), axis=0)])
        rows, paths = runs.run(sets, starts, self.samples + 1)
        off, changes = measured - rows[0], (rows[1:] - rows[0]).T
        activity = self._measure_activity(paths[0], runs)
        by_push, push_joint, felt_s = self._push(runs, paths[0], rows[0], activity)
        if has_run_away(changes) or has_run_away(by_push):
            return None
        ranges = np.ptp(paths[0][:, POSITIONS], axis=0)[self._joints]
        good = ~find_spikes(off, runs.joint, runs.at, sensor)
        return Reading(
            slot=history.slot,
            end_ns=history.end_ns,
            start=start,
            measured=measured[good],
            off=off[good],
            joint=runs.joint[good],
            at=runs.at[good],
            by_start=changes[good, : len(states)] / steps,
            by_signature=changes[good, len(states) :] / self._sizes,
            by_push=by_push[good],
            push_joint=push_joint,
            felt_s=felt_s,
            activity=activity,
            moves=bool(np.any(ranges > MOTION_FACTOR * sensor[self._joints])),
        )

    def _refine_start(
        self, measured: Floats, start: Floats, runs: WindowRuns, sensor: Floats
    ) -> Floats:
        """Return the start (4,) that explains the window best, by a step of Gauss and Newton."""
        states, steps = self._choose_steps(sensor)
        sets = np.zeros(1 + len(states), dtype=np.int64)
        rows, _ = runs.run(sets, self._vary(start, states, steps), self.samples + 1)
        columns = (rows[1:] - rows[0]).T
        refined = start.copy()
        refined[states] += steps * solve_least_squares(
            columns, measured - rows[0], sensor[runs.joint]
        )
        return refined

    def sketch(
        self, history: History, reading: Reading, sensor: Floats, theta: Floats
    ) -> list[Reading | None]:
        """Return roughly the window's readings with other twins; None for a twin that runs away.

        The start is varied but not refined, and there are no pushes; by_signature stays that of
        the reader's own twin.

        theta: (twins, SIZE) parameter vectors.
        """
        states, steps = self._choose_steps(sensor)
        starts = self._vary(reading.start, states, steps)
        first = len(history.command) - 1 - self.samples
        signals = self._make_signals(history.command)
        runs = WindowRuns(signals, theta, first, reading.joint, reading.at)
        sets = np.repeat(np.arange(len(theta)), len(starts))
        rows, _ = runs.run(sets, np.tile(starts, (len(theta), 1)), self.samples + 1)
        return [
            None
            if has_run_away(twin_rows)
            else replace(
                reading,
                off=reading.measured - twin_rows[0],
                by_start=((twin_rows[1:] - twin_rows[0]) / steps[:, None]).T,
            )
            for twin_rows in rows.reshape(len(theta), len(starts), -1)
        ]

    def compute_theta(self, signature: Signature, size: float) -> Floats:
        """Return the parameter vector (SIZE,) of the twin changed by a signature's size."""
        theta = self._theta[0].copy()
        theta[list(signature.theta)] += size * signature.per_unit
        return theta

    def _choose_steps(self, sensor: Floats) -> tuple[Ints, Floats]:
        """Return which states a start has, and the steps in which they are varied."""
        idle_rate = 0.005 * self._idle / IDLE_SHARE * WINDOW_S
        rate = sensor / (self._smooth * self._period_s) + idle_rate
        states = np.concatenate([self._joints, self._joints + 2])
        return states, np.concatenate([sensor, rate])[states]

    def _unwind(self, positions: Floats, first: int) -> Floats:
        """Return positions without the pole's whole turns at the window's begin.

        Turns stay for a twin whose laws differ from one turn to the next.
        """
        angles = positions[first:, 1]
        angles = angles[np.isfinite(angles)]
        if self._winds or not len(angles):
            return positions
        return positions - [0.0, 2 * np.pi * np.floor(angles[0] / (2 * np.pi))]

    def _vary(self, start: Floats, states: Ints, steps: Floats) -> Floats:
        """Return the start, and below it a row for each of its states, moved by its step."""
        starts = np.repeat(start[None], 1 + len(states), axis=0)
        starts[1 + np.arange(len(states)), states] += steps
        return starts

    def _push(
        self, runs: WindowRuns, path: Floats, rows: Floats, activity: Floats
    ) -> tuple[Floats, Ints, Floats]:
        """Return by_push, push_joint and felt_s of a `Reading`.

        Forces on the cart begin at a time and last, in both directions: a cart that sticks answers
        to nothing shorter. The pole's rate is changed at once.
        """
        times = np.arange(0, self.samples, self._spacing)
        forced = np.repeat(times[::2], 2) if 0 in self._joints else times[:0]
        turned = times[1:] if 1 in self._joints else times[:0]
        when = np.concatenate([forced, turned])
        is_turn = np.arange(len(when)) >= len(forced)
        way = np.resize([1.0, -1.0], len(forced))
        pushes = way * PUSH_SHARE * activity[0]
        kicks = np.full(len(turned), PUSH_SHARE * activity[1] * PUSH_SPACING_S)
        theta = np.repeat(self._theta[:1], len(when), axis=0)
        place, size = find_steady_push(theta[0])
        theta[: len(forced), place] += pushes * size
        starts = path[when]
        starts[len(forced) :, 3] += kicks
        later = runs.run_later(when, starts, theta, self.samples + 1)
        since = runs.at[None] - when[:, None]
        pushed = later[np.arange(len(when))[:, None], np.maximum(since, 0), runs.joint[None]]
        change = np.where(since > 0, pushed - rows[None], 0.0)
        by_push = (change / np.concatenate([pushes, kicks])[:, None]).T
        return by_push, is_turn.astype(np.int64), np.where(is_turn, PUSH_SPACING_S, np.sqrt(0.5))

    def _measure_activity(self, path: Floats, runs: WindowRuns) -> Floats:
        """Return the root mean square of all that accelerates each joint, (2,).

        Whatever pushes the cart counts, even while the cart sticks.
        """
        rates = np.diff(path[:, 2:], axis=0) / self._period_s
        a, b = np.sqrt(np.mean(rates**2, axis=0))
        theta = self._theta[0]
        command = np.sqrt(np.mean(runs.select_command(self.samples) ** 2))
        swing = theta[COUPLING] * (b + np.sqrt(np.mean(path[:, 3] ** 4)))
        cart = a + (theta[FORCE_PER_PWM] * command + swing + self._dry_n) / theta[MASS]
        return np.array([cart, b + theta[COUPLING] / theta[INERTIA] * a]) + self._idle

    def _smooth_start(self, positions: Floats, first: int) -> Floats | None:
        """Return the state at the window's begin by a cubic; None where samples are missing."""
        begin = max(0, first - self._smooth)
        around = positions[begin : first + self._smooth + 1]
        t = (np.arange(begin, begin + len(around)) - first) * self._period_s
        start = np.array([0.0, np.pi, 0.0, 0.0])
        for k in self._joints:
            good = np.isfinite(around[:, k])
            if good.sum() < LEAST_START_SAMPLES:
                return None
            fit = np.polynomial.polynomial.polyfit(t[good], around[good, k], 3)
            start[k], start[2 + k] = fit[0], fit[1]
        return start

    def _make_signals(self, command: Floats) -> Signals:
        """Return the commands for the kernel, the last held on for runs that start late."""
        padded = np.concatenate([command, np.full(self.samples + 1, command[-1])])
        blank, every = np.zeros(len(padded)), np.ones(len(padded), dtype=bool)
        return Signals(self._period_s, padded, blank, blank, every, every)


def _sum_dry_friction_n(twin: Twin) -> float:
    """Return the levels of dry friction that hold the cart, N."""
    return sum(
        values[parameter.name]
        for name, values in twin.effects.items()
        for parameter in BY_NAME[name].parameters
        if parameter.holds and BY_NAME[name].place is Place.CART and BY_NAME[name].form is Form.DRY
    )


def _compute_full_accelerations(rig: Rig) -> Floats:
    """Return the largest accelerations of cart (m/s^2) and pole (rad/s^2), roughly."""
    push = compute_full_force_n(rig) / rig.total_mass_kg
    turn = compute_full_torque_n_m(rig)
    if rig.has_pole and rig.has_cart:
        turn += rig.total_mass_kg * (rig.com_distance_m or 0.0) * push
    return np.array([push, turn / (rig.pole_inertia_kg_m2 or 1.0)])
