"""Fit constants and sizes beside a latent force: a remainder of the size that it really has.

A free run takes all that a twin lacks for noise of the sensors. Where much is lacking, the fit
bends constants until the runs stay near on this motion, and another motion bends them otherwise.
Here an unknown force on the cart and an unknown torque on the pole wander beside the twin
(Ornstein-Uhlenbeck; Alvarez, Luengo and Lawrence, AISTATS (2009)). Their sizes are those under
which the errors of prediction are most likely (prediction-error method; Ljung, System
Identification (1999), section 7.2). `docs/latent_force.md` compares both fits on real rigs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np
from scipy.optimize import minimize

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import make_fit
from pendulum_sysid.fitting.gauss_newton import measure_belief, refine_start_states, take_step
from pendulum_sysid.fitting.kalman_filter import filter_motion
from pendulum_sysid.fitting.linearised import System, linearise, list_neighbours
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.fitting.windows import gather, list_channels, shorten_windows
from pendulum_sysid.records import Fit, Split, Windows
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.free_runs import run_drive, run_driven
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS

ITERATIONS = 15
ROUNDS = 4  # of the force's sizes and the twin's parameters, in turns
GAINED = 0.01  # of the log likelihood: a smaller gain ends the iterations
FIRST_SHARE = 0.05  # of the root mean square force of the motion: where the search begins
FIRST_CORRELATION_S = 0.05
FIRST_STEP = 1.0  # of the logarithms of a force's numbers, in which the search steps
CORRELATIONS_S, NOISE_RATIOS = (0.002, 10.0), (0.1, 100.0)
LEAST_DEVIATION = 1e-7  # m, rad, m/s, rad/s; of a step along a state, for differences
RUN_S = 10.0  # of a run of the filter, far longer than the memory of its start
SAMPLES_AT_ONCE = 100_000  # bounds the memory
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
        drives = run_drive(self.case.signals, theta)
        ends = np.array([self._run(drives, theta, k, 0.0) for k in range(len(theta))])
        transitions = np.zeros((len(self._first), 4, 4))
        transitions[:, range(4), range(4)] = 1.0
        for move, entry, size in zip(moves, varied, sizes, strict=True):
            change = self._run(drives, theta, 0, move) - self._run(drives, theta, 0, -move)
            transitions[..., entry] = change / (2.0 * size)
        return Steps(ends - self._ends, transitions, self._list_pushes(theta[0]))

    def _run(
        self, drives: tuple[Floats, Ints], theta: Floats, chosen: int, move: Floats | float
    ) -> Floats:
        """Return the states at the ends of the steps, (samples, 4)."""
        set_of = np.full(len(self._begin), chosen)
        ends = self._ends.copy()
        with np.errstate(all="ignore"):
            states = run_driven(
                self.case.signals, drives, theta, set_of, self._begin, self._starts + move, 2
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


def fit_under_latent_force(case: Case, split: Split, fit: Fit) -> tuple[Fit, System]:
    """Return a fit's twin with constants and sizes that are most likely beside a latent force.

    fit: where the iterations begin; its effects stay.

    Returns the fit, judged by free runs as any other, and the normal equations of the errors of
    prediction, a row for each piece of a window (`Fit.pieces`).
    """
    free = list_free_parameters(case.twin, fit.effects, case.scales)
    runs = _cut_runs(case)
    parts = [Predictions(case, group, split.learn) for group in _group(runs)]
    few = max(round(decisions.FORCE_SECONDS / RUN_S), 1)
    some = runs[:: max(len(runs) // few, 1)]
    thinned = Predictions(case, some, split.learn)
    theta, latent, reached = fit.theta, _guess(case, fit.theta), np.inf
    for _ in range(ROUNDS):
        latent = _fit_force(thinned, theta, latent)
        theta, cost = _solve(parts, theta, free, latent)
        if reached - cost < GAINED * len(split.learn):
            break
        reached = cost
    problem = case.problem(shorten_windows(case.state, split.learn, fit.pieces))
    refined = replace(refine_start_states(problem, theta), theta=theta)
    starts = linearise(problem, theta, refined.start_states, (), refined.power)
    whole = _linearise(parts, theta, free, latent)
    system = replace(
        starts,
        normals=np.repeat(whole.normals, fit.pieces, axis=0) / fit.pieces,
        scores=np.repeat(whole.scores, fit.pieces, axis=0) / fit.pieces,
        cross=np.zeros((*starts.start_gradient.shape, len(free))),
        beliefs=whole.beliefs,
        pulls=whole.pulls,
    )
    solution = replace(refined, system=system)
    return make_fit(case, split, fit.effects, problem, solution, free, fit.pieces), system


def _cut_runs(case: Case) -> list[range]:
    """Return the recording in runs of at most RUN_S, none across a seam."""
    length = max(round(RUN_S / case.signals.period_s), 2)
    return [
        range(begin, min(begin + length, stretch.stop))
        for stretch in case.signals.stretches
        for begin in range(stretch.start, stretch.stop - 1, length)
    ]


def _group(runs: list[range]) -> list[list[range]]:
    """Return the runs in groups whose steps fit into memory together."""
    size = max(SAMPLES_AT_ONCE // max(len(run) for run in runs), 1)
    return [runs[k : k + size] for k in range(0, len(runs), size)]


def _guess(case: Case, theta: Floats) -> LatentForce:
    """Return a force that is a small share of the forces of the motion."""
    cart, pole = np.sqrt(np.mean(case.state.accelerations**2, axis=0))
    force, torque = theta[MASS] * max(cart, 1e-3), theta[INERTIA] * max(pole, 1e-3)
    first_n, first_n_m = FIRST_SHARE * float(force), FIRST_SHARE * float(torque)
    return LatentForce(first_n, first_n_m, FIRST_CORRELATION_S, 1.0)


def _fit_force(predictions: Predictions, theta: Floats, first: LatentForce) -> LatentForce:
    """Return the latent force under which the errors of prediction are most likely."""
    steps = predictions.run_steps(theta[None])
    bounds = [*[(None, None)] * 2, np.log(CORRELATIONS_S), np.log(NOISE_RATIOS)]
    begin = np.log(astuple(first))
    simplex = begin + FIRST_STEP * np.tri(len(begin) + 1, len(begin), -1)

    def compute_cost(logs: Floats) -> float:
        return predictions.whiten(steps, LatentForce(*np.exp(logs)))[1]

    ended = minimize(
        compute_cost,
        begin,
        method="Nelder-Mead",
        bounds=bounds,
        options={"xatol": 0.1, "fatol": 0.1, "initial_simplex": simplex},
    )
    return LatentForce(*np.exp(ended.x))


def _solve(
    parts: Sequence[Predictions], theta: Floats, free: tuple[Free, ...], latent: LatentForce
) -> tuple[Floats, float]:
    """Return the most likely theta (SIZE,) beside a latent force, and its cost."""

    def compute_cost(theta: Floats) -> float:
        costs = [part.whiten(part.run_steps(theta[None]), latent)[1] for part in parts]
        return 0.5 * measure_belief(free, theta) + sum(costs)

    cost, damping = compute_cost(theta), 1e-6
    for _ in range(ITERATIONS):
        system = _linearise(parts, theta, free, latent)
        while True:
            reached = take_step(system, theta, np.empty((0, 4)), free, damping)[0]
            new_cost = compute_cost(reached)
            if new_cost < cost or damping > 1e4:
                break
            damping = max(damping * 10.0, 1e-3)
        if not new_cost < cost:
            break
        gain, cost, theta = cost - new_cost, new_cost, reached
        damping = max(damping * 0.1, 1e-9)
        if gain < GAINED:
            break
    return theta, cost


def _linearise(
    parts: Sequence[Predictions], theta: Floats, free: tuple[Free, ...], latent: LatentForce
) -> System:
    """Return the normal equations of the errors of prediction, a row a window, without starts."""
    sets, scale = list_neighbours(theta, free)
    windows = 1 + max(int(part.window_of.max(initial=-1)) for part in parts)
    normals, scores = np.zeros((windows, len(free), len(free))), np.zeros((windows, len(free)))
    for part in parts:
        steps = part.run_steps(sets)
        steps.gaps[1:] = (steps.gaps[1:] - steps.gaps[:1]) * scale[:, None, None]
        white, _ = part.whiten(steps, latent)
        columns = -np.moveaxis(white[1:], 0, -1)
        counted = part.window_of >= 0
        at = part.window_of[counted]
        np.add.at(normals, at, (columns.transpose(0, 2, 1) @ columns)[counted])
        np.add.at(scores, at, np.einsum("pcf,pc->pf", columns, white[0])[counted])
    return System(
        normals=normals,
        scores=scores,
        start_normal=np.empty((0, 0, 0)),
        start_gradient=np.empty((0, 0)),
        cross=np.empty((0, 0, len(free))),
        start_sizes=np.empty(0),
        varied=[],
        beliefs=np.array([p.belief for p in free]),
        pulls=np.array([p.compute_pull(theta) for p in free]),
    )
