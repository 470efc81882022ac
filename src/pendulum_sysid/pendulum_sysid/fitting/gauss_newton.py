"""Least squares over many windows: common parameters, and a start state for each window.

Multiple shooting with the start states eliminated by a Schur complement (Bock, in Numerical
Treatment of Inverse Problems (1983); Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973) 413). The
variance of each channel is estimated along (the concentrated likelihood), so that a channel whose
model is still wrong does not outshout the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from scipy.special import stdtrit

from pendulum_sysid import decisions
from pendulum_sysid.fitting.linearised import System, assemble, linearise
from pendulum_sysid.fitting.neighbours import run_neighbours
from pendulum_sysid.fitting.parameters import Free, keep_definite
from pendulum_sysid.fitting.problem import Problem, compute_errors, list_varied
from pendulum_sysid.fitting.windows import gather
from pendulum_twin.arrays import Floats

OFF = 1e6  # m or rad; as far as a run may count that has left all bounds
CONVERGED = 1e-5  # relative gain of the likelihood a sample
MOST_ITERATIONS = 60  # most fits need 4 to 12; a stretching belt beside warming friction, over 20


@dataclass(frozen=True)
class Solution:
    """Hold a fit of free parameters and start states.

    theta: (SIZE,) parameter vector.
    start_states: (windows, 4) fitted start states x, th, v, w.
    squares, counts: (windows, channels) sum of squared errors (m^2, rad^2), and samples.
    converged: whether the last step gained hardly anything.
    system: the normal equations there; None where no parameter was free, and before
        `complete_system` where the iterations ended first.
    """

    theta: Floats
    start_states: Floats
    squares: Floats
    counts: Floats
    converged: bool = True
    system: System | None = None

    @property
    def power(self) -> Floats:
        """Return each channel's mean squared error."""
        return compute_power(self.squares, self.counts)

    def misfit(self, noise: Floats) -> float:
        """Return the geometric mean over channels of root mean square error / noise."""
        return compute_misfit(self.squares, self.counts, noise)


def compute_misfit(squares: Floats, counts: Floats, noise: Floats) -> float:
    """Return the geometric mean over channels of root mean square error / noise.

    squares, counts: (windows, channels) sum of squared errors (m^2, rad^2), and samples.
    noise: (channels,) m or rad.
    """
    return float(np.exp(0.5 * np.mean(np.log(compute_power(squares, counts) / noise**2))))


def compute_power(squares: Floats, counts: Floats) -> Floats:
    """Return each channel's mean squared error; squares, counts: (windows, channels)."""
    return np.maximum(squares.sum(axis=0) / np.maximum(counts.sum(axis=0), 1.0), 1e-30)


def compute_cost(
    problem: Problem,
    start_states: Floats,
    squares: Floats,
    counts: Floats,
    restraint: float = 0.0,
) -> float:
    """Return the concentrated negative log likelihood a sample.

    Errors are Gaussian, with the variance of each channel that fits them best.

    restraint: squared distance of the parameters from what is believed of them, in deviations, and
        the penalty.
    """
    total = counts.sum(axis=0)
    varied = list_varied(problem)
    moved = (start_states - problem.windows.start_states)[:, varied] / problem.deviations[varied]
    return float(
        (np.sum(total * np.log(compute_power(squares, counts))) + np.sum(moved**2) + restraint)
        / (2 * total.sum())
    )


def measure_belief(free: tuple[Free, ...], theta: Floats) -> float:
    """Return the squared distance of theta (SIZE,) from what is believed of it, in deviations."""
    return float(sum(p.belief * p.compute_pull(theta) ** 2 for p in free))


def measure_penalty(free: tuple[Free, ...], theta: Floats, penalty: Floats | None) -> float:
    """Return what a penalty (parameters, parameters) adds to the cost at theta (SIZE,)."""
    if penalty is None:
        return 0.0
    scaled = scale_values(free, theta)
    return float(scaled @ penalty @ scaled)


def scale_values(free: Sequence[Free], theta: Floats) -> Floats:
    """Return the free parameters in their sizes, (parameters,)."""
    return np.array([parameter.get(theta) / parameter.size for parameter in free])


def solve(
    problem: Problem,
    theta: Floats,
    free: tuple[Free, ...],
    start_states: Floats | None = None,
    iterations: int = MOST_ITERATIONS,
    penalty: Floats | None = None,
    known: System | None = None,
    least_gain: float = CONVERGED,
) -> Solution:
    """Return the fit of the free parameters and of the windows' start states, from theta.

    Without free parameters the start states alone are fitted. Steps that do not improve are
    shortened (Levenberg-Marquardt). Bounds hold, and the mass matrix stays positive definite.

    penalty: (parameters, parameters) that pulls the parameters, in their sizes, to 0; or None.
    known: the normal equations at theta and the start states, without the penalty; None where
        they are to be computed.
    least_gain: of an iteration, in nats a sample; a smaller gain ends the fit.
    """
    windows = problem.windows
    starts: Floats = (windows.start_states if start_states is None else start_states).copy()
    theta = keep_definite(theta.copy())
    counts = gather(problem.signals, windows.begin, windows.samples)[1].sum(axis=1)

    def measure(theta: Floats, starts: Floats) -> tuple[Floats, float]:
        squares = _compute_squares(problem, theta, starts)
        restraint = measure_belief(free, theta) + measure_penalty(free, theta, penalty)
        return squares, compute_cost(problem, starts, squares, counts, restraint)

    squares, cost = measure(theta, starts)
    damping = 1e-6

    def conclude(converged: bool, system: System | None) -> Solution:
        near = bool(np.all(squares < OFF**2))  # a run that left all bounds shows no way back
        return Solution(theta, starts, squares, counts, converged and near, system)

    for _ in range(iterations):
        system, list_parts = _linearise(problem, theta, starts, free, squares, counts, known)
        known = None
        while True:
            new_theta, new_starts = take_step(system, theta, starts, free, damping, penalty)
            new_squares, new_cost = measure(new_theta, new_starts)
            if new_cost < cost or damping > 1e4:
                break
            damping = max(damping * 10, 1e-3)
        if not new_cost < cost:
            return conclude(True, list_parts() if free else None)
        gain, cost = cost - new_cost, new_cost
        before, theta, starts, squares = theta, new_theta, new_starts, new_squares
        damping = max(damping * 0.1, 1e-9)
        if gain < least_gain:
            parts = shift_system(list_parts(), free, before, theta) if free else None
            return conclude(True, parts)
        del list_parts  # the runs that it holds take much memory
    return conclude(False, None)


def _linearise(
    problem: Problem,
    theta: Floats,
    starts: Floats,
    free: tuple[Free, ...],
    squares: Floats,
    counts: Floats,
    known: System | None,
) -> tuple[System, Callable[[], System]]:
    """Return the normal equations of an iteration, and what returns each window's part of them.

    The parts take most of the time, and only the last iteration needs them.
    """
    if known is not None:
        return known, lambda: known
    errors = run_neighbours(problem, theta, starts, free, compute_power(squares, counts))
    list_parts = partial(assemble, problem, starts, errors)
    return list_parts(summed=True), list_parts


def _compute_squares(problem: Problem, theta: Floats, starts: Floats) -> Floats:
    """Return squared errors (windows, channels); a run that leaves all bounds counts as OFF."""
    with np.errstate(all="ignore"):
        errors = np.nan_to_num(compute_errors(problem, theta, starts), nan=OFF)
        return np.asarray(np.sum(np.clip(errors, -OFF, OFF) ** 2, axis=1))


def complete_system(problem: Problem, solution: Solution, free: tuple[Free, ...]) -> Solution:
    """Return the solution with the normal equations at its end."""
    if not free or solution.system is not None:
        return solution
    theta, starts = solution.theta, solution.start_states
    return replace(solution, system=linearise(problem, theta, starts, free, solution.power))


def shift_system(system: System, free: tuple[Free, ...], before: Floats, after: Floats) -> System:
    """Return the system at `before` (SIZE,) with its gradient at `after`, a whole step further.

    The gradient follows the step to first order, and that of the start states vanishes; the
    matrices stay as they are.
    """
    step = np.array([(p.get(after) - p.get(before)) / p.size for p in free])
    return replace(
        system,
        scores=system.scores - system.normals @ step,
        start_gradient=np.zeros_like(system.start_gradient),
        pulls=np.array([p.compute_pull(after) for p in free]),
    )


def take_step(
    system: System,
    theta: Floats,
    start_states: Floats,
    free: tuple[Free, ...],
    damping: float,
    penalty: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Return theta and start states after one damped step, parameters within their bounds.

    penalty: (parameters, parameters) that pulls the parameters, in their sizes, to 0; or None.
    """
    whole_normal, gradient = system.normal, system.gradient
    if penalty is not None:
        whole_normal = whole_normal + penalty
        gradient = gradient - penalty @ scale_values(free, theta)
    values = np.array([parameter.get(theta) for parameter in free])
    sizes = np.array([parameter.size for parameter in free])
    low, high = (
        np.array([parameter.low for parameter in free]),
        np.array([parameter.high for parameter in free]),
    )
    step = np.zeros(len(free))
    loose = np.ones(len(free), dtype=bool)
    for _ in range(len(free)):
        normal = whole_normal[np.ix_(loose, loose)]
        diagonal = np.diag(normal) + 1e-12
        remainder = gradient[loose] - whole_normal[np.ix_(loose, ~loose)] @ step[~loose]
        step[loose] = np.linalg.lstsq(
            normal + damping * np.diag(diagonal), remainder, rcond=1e-13
        )[0]
        reached = values + step * sizes
        out = loose & ((reached < low) | (reached > high))
        if not out.any():
            break
        step[out] = (np.clip(reached, low, high) - values)[out] / sizes[out]
        loose &= ~out
        if not loose.any():
            break
    new_theta = theta.copy()
    for parameter, value, change in zip(free, values, step * sizes, strict=True):
        parameter.put(new_theta, float(np.clip(value + change, parameter.low, parameter.high)))
    remainder = system.start_gradient - system.cross @ step
    moves = np.linalg.solve(system.start_normal, remainder[..., None])[..., 0]
    new_start_states = start_states.copy()
    new_start_states[:, system.varied] += moves * system.start_sizes
    return keep_definite(new_theta), new_start_states


def compute_half_widths(solution: Solution, free: tuple[Free, ...], together: int = 1) -> Floats:
    """Return the half widths of 95 % intervals, (parameters,); infinite where nothing is fixed.

    together: how many windows in a row are pieces of one longer window.

    The gradients of the longer windows count as independent, and their scatter is taken as it is:
    a sandwich clustered by window, which stays honest when the model is wrong. No width is smaller
    than the classical width. What a window's own weight in the fit takes off its gradient is put
    back (CR2 of Bell and McCaffrey, Survey Methodology 28 (2002) 169; Cameron and Miller, J. Human
    Resources 50 (2015) 317, section VI).
    """
    if not free:
        return np.empty(0)
    assert solution.system is not None
    spread, variance, count = compute_sandwich(solution.system, together)
    return (
        stdtrit(max(count - 1, 1), 0.975)
        * np.sqrt(np.maximum(np.diag(spread), variance))
        * np.array([parameter.size for parameter in free])
    )


def compute_correlations(solution: Solution, free: tuple[Free, ...], together: int = 1) -> Floats:
    """Return the correlations of the estimation errors, (parameters, parameters).

    From the spread by which `compute_half_widths` measures; NaN for a parameter that nothing
    fixes.
    """
    if not free:
        return np.empty((0, 0))
    assert solution.system is not None
    spread, variance, _ = compute_sandwich(solution.system, together)
    deviation = np.sqrt(np.where(np.isfinite(variance), np.diag(spread), np.nan))
    with np.errstate(all="ignore"):
        return np.asarray(np.clip(spread / np.outer(deviation, deviation), -1.0, 1.0))


def compute_sandwich(
    system: System, together: int, penalty: Floats | float = 0.0
) -> tuple[Floats, Floats, int]:
    """Return the sandwich, the classical variances, and how many longer windows there are.

    Both in units of each parameter's size; the variances are infinite where nothing is fixed.

    together: as of `compute_half_widths`.
    penalty: (parameters, parameters) that the fit adds to the normal matrix.
    """
    count = system.normals.shape[1]
    scores = system.scores.reshape(-1, together, count).sum(axis=1)
    normals = system.normals.reshape(-1, together, count, count).sum(axis=1)
    values, vectors = np.linalg.eigh(system.normal + penalty)
    blind = values < 1e-10 * max(values.max(), 1e-300)
    root = vectors / np.sqrt(np.where(blind, np.inf, values))  # root @ root.T is the inverse
    weights, directions = np.linalg.eigh(root.T @ normals @ root)
    turned = (directions.transpose(0, 2, 1) @ (scores @ root)[..., None])[..., 0]
    scaled = (
        directions
        @ (turned / np.sqrt(1 - weights.clip(0.0, decisions.ONE_WINDOW_SHARE)))[..., None]
    )[..., 0]
    shares = scaled @ root.T
    spread = shares.T @ shares  # symmetric to the last bit: a product with its own transpose
    variance = np.where((vectors**2 @ blind) > 1e-6, np.inf, np.sum(root**2, axis=1))
    return spread, variance, len(scores)


def refine_start_states(problem: Problem, theta: Floats) -> Solution:
    """Fit the start states alone: how well a fixed twin can run at all.

    The first quarter of each window comes first. Near upright, whole windows that begin at
    smoothed start states end in a wrong local minimum: with 1024 counts a turn and a controller at
    work, at 55 to 117 times the noise in 3 of 12 recordings, in place of 0.8.
    """
    windows = problem.windows
    begin = replace(windows, samples=(windows.samples - 1) // 4 + 1)
    begun = solve(replace(problem, windows=begin), theta, (), iterations=4)
    return solve(problem, theta, (), begun.start_states, iterations=4)
