"""Fit one set of effects together with the rig's constants."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.cross_validation import compute_left_out_misfit, cross_validate
from pendulum_sysid.fitting.gauss_newton import (
    Solution,
    complete_system,
    compute_correlations,
    compute_half_widths,
    solve,
)
from pendulum_sysid.fitting.instants import widen_over_gaps
from pendulum_sysid.fitting.parameters import (
    JUMPS,
    Free,
    convert_distance,
    list_free_parameters,
    list_rig_parameters,
    make_estimate,
    make_twin,
)
from pendulum_sysid.fitting.windows import shorten_windows
from pendulum_sysid.records import Estimate, Fit, Split, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.parameter_vector import SLOTS, make_theta
from pendulum_twin.signals import Signals

DELAYS = {f"{e.name}.{p.name}": p for e in CATALOGUE for p in e.parameters if p.delays}
HORIZONS = (4, 1)  # pieces of a window: 0.25 s and 1 s


def fit(
    case: Case,
    split: Split,
    effects: tuple[str, ...],
    theta: Floats,
    pieces: int = 1,
    start_states: Floats | None = None,
) -> Fit:
    """Return the fit of the rig's constants and the effects' parameters, cross-validated.

    theta: (SIZE,) parameter vector to start from; the parameters of the effects are not neutral.
    pieces: how many pieces each window is cut into: over a short horizon errors stay where they
        arise, over a long horizon small errors add up.
    start_states: (windows * pieces, 4) start states of a nearby fit; None for none.
    """
    free = list_free_parameters(case.twin, effects, case.scales)
    problem = case.problem(shorten_windows(case.state, split.learn, pieces))
    solution = complete_system(problem, solve(problem, theta, free, start_states), free)
    left_out = cross_validate(problem, solution, free, pieces)
    estimates = _make_estimates(solution, free, pieces)
    return Fit(
        twin=make_twin(case.twin, solution.theta, effects, list_rig_parameters(case.twin)),
        effects=effects,
        estimates={
            **widen_estimates(estimates, case, split.learn),
            **estimate_located(case, effects, solution.theta),
        },
        theta=solution.theta,
        start_states=solution.start_states,
        power=solution.power,
        train=solution.misfit(case.noise),
        choose=compute_left_out_misfit(solution.system, left_out, solution.counts, case.noise),
        window_squares=left_out,
        counts=solution.counts,
        noise=case.noise,
        pieces=pieces,
        converged=solution.converged,
        correlations=compute_correlations(solution, free, pieces),
    )


def begin_fit(
    case: Case,
    split: Split,
    effects: tuple[str, ...],
    thetas: Floats,
    pieces: int = 1,
    start_states: Floats | None = None,
) -> tuple[Floats, Floats]:
    """Return theta and start states of the fit that is ahead after a few steps from each start.

    A start from which a fit goes on to the same place, or to a worse place, shows so early.

    thetas: (starts, SIZE) parameter vectors.
    """
    free = list_free_parameters(case.twin, effects, case.scales)
    problem = case.problem(shorten_windows(case.state, split.learn, pieces))
    begun = [
        solve(problem, theta, free, start_states, decisions.STEPS_A_START) for theta in thetas
    ]
    ahead = min(begun, key=lambda solution: solution.misfit(case.noise))
    return ahead.theta, ahead.start_states


def fit_over_horizon(case: Case, split: Split, known: Fit, pieces: int) -> Fit:
    """Return a known fit's effects fitted from where it ended, over the same or another horizon.

    pieces: how many pieces each window is cut into.

    Longer windows begin where the known fit begins their first pieces. Near upright, smoothed
    start states lead a fit over whole windows astray: with 1024 counts a turn and a controller at
    work, to 52 times the noise in place of 0.87.
    """
    continues = known.pieces % pieces == 0
    starts = known.start_states[:: known.pieces // pieces] if continues else None
    return fit(case, split, known.effects, known.theta, pieces, starts)


def fit_own_parameters(case: Case, split: Split) -> Fit:
    """Fit the rig's constants and the parameters of the effects that the twin has.

    Short horizons come first: they lead to the solution from far away. The estimates are those of
    the fitted twin, com_distance_m with its masses.
    """
    fitted = fit(case, split, tuple(case.twin.effects), make_theta(case.twin), HORIZONS[0])
    for horizon in HORIZONS[1:]:
        fitted = fit_over_horizon(case, split, fitted, horizon)
    return replace(fitted, estimates=convert_distance(fitted.estimates, case.twin, fitted.twin))


def widen_estimates(
    estimates: dict[str, Estimate], case: Case, windows: Windows
) -> dict[str, Estimate]:
    """Return estimates that are no finer than command times, a run's jumps and gaps allow."""
    widened = _widen_jumps(_widen_delays(estimates, case))
    return widen_over_gaps(widened, case.signals, windows)


def _widen_delays(estimates: dict[str, Estimate], case: Case) -> dict[str, Estimate]:
    """Return the estimates, delays no better than the times of the commands are known."""
    latency = case.recording.command_latency
    scatter_s = (latency.spread_s if latency is not None else None) or 0.0
    half = max(case.recording.timing_spread_s / 2.0, decisions.INTERVAL_DEVIATIONS * scatter_s)
    return {
        name: replace(
            e,
            low=max(e.low - half, DELAYS[name].low),
            high=min(e.high + half, DELAYS[name].high),
        )
        if name in DELAYS
        else e
        for name, e in estimates.items()
    }


def _widen_jumps(estimates: dict[str, Estimate]) -> dict[str, Estimate]:
    """Return the estimates, none finer than a run that jumps with the parameter can tell."""
    return {
        name: replace(
            e,
            low=min(e.low, e.value * (1.0 - JUMPS[name])),
            high=max(e.high, e.value * (1.0 + JUMPS[name])),
        )
        if name in JUMPS
        else e
        for name, e in estimates.items()
    }


def estimate_located(case: Case, effects: tuple[str, ...], theta: Floats) -> dict[str, Estimate]:
    """Return the times that were read off the recording, as far as its samples tell them."""
    located = {}
    for name in effects:
        for k, p in enumerate(BY_NAME[name].parameters):
            if p.located:
                value = float(theta[SLOTS[name].start + k])
                half = _halve_gap(case.signals, value)
                located[f"{name}.{p.name}"] = Estimate(
                    value, max(value - half, p.low), value + half
                )
    return located


def _halve_gap(signals: Signals, time_s: float) -> float:
    """Return half of the time (s) between the usable angles before and after an instant."""
    clock = signals.clock_s[signals.pole_valid]
    after = min(int(np.searchsorted(clock, time_s, side="right")), len(clock) - 1)
    return float(clock[after] - clock[max(after - 1, 0)]) / 2


def _make_estimates(
    solution: Solution, free: tuple[Free, ...], pieces: int
) -> dict[str, Estimate]:
    halves = compute_half_widths(solution, free, pieces).tolist()
    return {
        parameter.name: make_estimate(parameter, parameter.get(solution.theta), half)
        for parameter, half in zip(free, halves, strict=True)
    }
