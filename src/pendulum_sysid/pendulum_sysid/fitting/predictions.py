"""Predict a recording sample by sample along its smoothed motion, beside a latent force.

A free run adds up all that a twin lacks. A prediction begins anew at every sample, from what a
filter makes of the samples before: its errors stay where they arise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.kalman_filter import filter_motion
from pendulum_sysid.fitting.windows import gather, list_channels
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.free_runs import run_drive, run_driven
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS

LEAST_DEVIATION = 1e-7  # m, rad, m/s, rad/s; of a step along a state, for differences
FAR = 1e3  # what a run counts as that has left all bounds


@dataclass(frozen=True)
class LatentForce:
    """Describe the force on the cart and the torque on the pole that wander beside a twin.

    force_n, torque_n_m: standard deviations.
    correlation_s: time over which they stay alike.
    noise_ratio: the noise of the sensors, over that which the smoothing measured.
    """

    force_n: float
    torque_n_m: float
    correlation_s: float
    noise_ratio: float


@dataclass(frozen=True)
class Steps:
    """Hold runs of one sample each, begun all along the smoothed motion.

    The arrays are those of `filter_motion`; gaps has a column for each parameter vector.
    """

    gaps: Floats
    transitions: Floats
    pushes: Floats


class Predictions:
    """Predict a part of a recording along its smoothed motion, beside a latent force.

    Positions are predicted every `decisions.PREDICTED_EVERY_S`, whatever the rate of the samples:
    over shorter times, what filters and clocks do to single samples would count most.
    """

    def __init__(self, case: Case, runs: Sequence[range], windows: Windows) -> None:
        """Prepare the samples of some runs.

        runs: of samples in a row.
        windows: of which alone the errors of prediction count; other samples correct the filter.
        """
        signals, states = case.signals, case.state.states
        at = np.concatenate([np.arange(run.start, run.stop) for run in runs])
        within = np.concatenate([np.arange(len(run)) for run in runs])
        every = max(round(decisions.PREDICTED_EVERY_S / signals.period_s), 1)
        self.case = case
        self._channels = np.array(list_channels(signals))
        self._first, self._predicted = within == 0, (within % every == 0) & (within > 0)
        measured, counts = gather(signals, at, 1)
        self._counts = counts[:, 0]
        off = measured[:, 0] - states[at][:, self._channels]
        self._measured = np.where(self._counts > 0.0, off, 0.0)
        self._ends = states[at]
        self._begin = at[~self._first] - 1
        self._starts = states[self._begin]
        window = np.searchsorted(windows.begin, at[self._predicted], side="left") - 1
        last = windows.begin[window] + windows.samples - 1
        self.window_of = np.where((window >= 0) & (at[self._predicted] <= last), window, -1)

    def run_steps(self, theta: Floats) -> Steps:
        """Return runs of one sample along the motion.

        theta: (sets, SIZE); the first set's derivatives are those of `transitions`.
        """
        varied = [*self._channels, *(self._channels + 2)]
        sizes = np.maximum(self.case.state.deviations[varied], LEAST_DEVIATION)
        moves = np.zeros((len(varied), 4))
        moves[range(len(varied)), varied] = sizes
        own = run_drive(self.case.signals, theta[:1])
        others = (self._run(run_drive(self.case.signals, t[None]), t, 0.0) for t in theta[1:])
        ends = np.array([self._run(own, theta[0], 0.0), *others])
        transitions = np.zeros((len(self._first), 4, 4))
        transitions[:, range(4), range(4)] = 1.0
        for move, entry, size in zip(moves, varied, sizes, strict=True):
            change = self._run(own, theta[0], move) - self._run(own, theta[0], -move)
            transitions[..., entry] = change / (2.0 * size)
        return Steps(ends - self._ends, transitions, self._list_pushes(theta[0]))

    def _run(self, drives: tuple[Floats, Ints], theta: Floats, move: Floats | float) -> Floats:
        """Return the states at the ends of the steps, (samples, 4).

        drives: what command and drive make of the recording for theta (SIZE,) (`run_drive`).
        """
        first = np.zeros(len(self._begin), dtype=np.int64)
        ends = self._ends.copy()
        with np.errstate(all="ignore"):
            states = run_driven(
                self.case.signals, drives, theta[None], first, self._begin, self._starts + move, 2
            )[:, 1]
        ends[~self._first] = np.nan_to_num(states, nan=0.0, posinf=FAR, neginf=-FAR)
        return ends

    def _list_pushes(self, theta: Floats) -> Floats:
        """Return what a unit of force and torque add to a state over a sample.

        By the inverse of the mass matrix [[m, -S cos th], [-S cos th, J]].
        """
        period_s = self.case.signals.period_s
        both = len(self._channels) == 2
        coupling = (
            theta[COUPLING] * np.cos(self._ends[:, 1]) if both else np.zeros(len(self._ends))
        )
        mass, inertia = theta[MASS], theta[INERTIA]
        rest = mass * inertia - coupling**2
        inverse = np.zeros((len(coupling), 2, 2))
        inverse[:, 0, 0] = inertia / rest if 0 in self._channels else 0.0
        inverse[:, 1, 1] = mass / rest if 1 in self._channels else 0.0
        inverse[:, 0, 1] = inverse[:, 1, 0] = coupling / rest
        return np.concatenate([0.5 * period_s**2 * inverse, period_s * inverse], axis=1)

    def whiten(self, steps: Steps, latent: LatentForce) -> tuple[Floats, float]:
        """Return whitened errors of prediction, (columns, predictions, channels); and -ln L.

        L is the likelihood of the errors that count; the others are 0.
        """
        period_s = self.case.signals.period_s
        decay = float(np.exp(-period_s / latent.correlation_s))
        powers = np.array([latent.force_n, latent.torque_n_m]) ** 2
        starts = (decisions.START_DOUBT * self.case.state.deviations) ** 2
        many = len(self.window_of)
        white = np.zeros((len(steps.gaps), many, len(self._channels)))
        log_deviations = np.zeros(many)
        filter_motion(
            self._first,
            self._predicted,
            steps.gaps,
            steps.transitions,
            steps.pushes,
            self._measured,
            self._counts,
            self._channels,
            np.concatenate([starts, powers]),
            decay,
            powers * (1.0 - decay**2),
            (latent.noise_ratio * self.case.noise) ** 2,
            white,
            log_deviations,
        )
        counted = self.window_of >= 0
        white[:, ~counted] = 0.0
        return white, 0.5 * float(np.sum(white[0] ** 2)) + float(log_deviations[counted].sum())
