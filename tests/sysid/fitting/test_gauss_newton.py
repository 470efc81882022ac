"""The fit finds known answers, agrees with dense algebra, and its intervals are honest."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import t as student
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.gauss_newton import (
    CONVERGED,
    Solution,
    compute_correlations,
    compute_cost,
    compute_half_widths,
    solve,
)
from pendulum_sysid.fitting.linearised import System, linearise
from pendulum_sysid.fitting.parameters import Free, list_rig_parameters
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.fitting.windows import cut_windows, gather, list_channels
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

TRUTH = replace(INTECO, rig=replace(INTECO.rig, cart_viscous_n_s_m=2.0))
FAR = {  # factors on the truth
    "force_per_pwm_n": 2.0,
    "cart_viscous_n_s_m": 0.5,
    "com_distance_m": 1.5,
    "pole_inertia_kg_m2": 0.6,
    "pole_viscous_n_m_s": 2.0,
}
NEAR = 0.05  # of an interval: one-sided differences over steps of finite size leave this much


def make_reduced_system(normals: Floats, scores: Floats) -> System:
    """Return normal equations without start states."""
    nothing = np.zeros((len(normals), 0))
    return System(normals, scores, nothing, nothing, nothing, np.empty(0), [])


def off(factors: dict[str, float]) -> Twin:
    return replace(
        TRUTH, rig=replace(TRUTH.rig, **{k: f * getattr(TRUTH.rig, k) for k, f in factors.items()})
    )


def true_value(name: str) -> float:
    return getattr(TRUTH.rig, name)


@pytest.fixture(scope="module")
def near() -> Case:
    return prepare_case(
        [made(TRUTH, 12.0, 0.3, seed=1)],
        off({"force_per_pwm_n": 1.02, "cart_viscous_n_s_m": 0.95}),
    )


@pytest.fixture(scope="module")
def problem(near: Case) -> Problem:
    return near.problem(split_windows(near.signals, near.state).train)


@pytest.fixture(scope="module")
def free(near: Case) -> tuple[Free, ...]:
    return list_rig_parameters(near.twin)


@pytest.mark.parametrize("power", [1, -1])
def test_parameters_are_found_from_far(power: int) -> None:
    case = prepare_case(
        [made(TRUTH, 20.0, 0.3, seed=2)], off({k: f**power for k, f in FAR.items()})
    )
    parts_apart = split_windows(case.signals, case.state)
    theta = make_theta(case.twin)
    for parts in HORIZONS:
        found = fit(case, parts_apart, (), theta, parts)
        theta = found.theta
    assert HORIZONS == (4, 1) and found.converged
    for name, one in found.estimates.items():
        assert one.value == pytest.approx(true_value(name), rel=0.02), name
        assert one.low < one.value < one.high and one.identifiable
        assert getattr(found.twin.rig, name) == one.value
    assert found.train == pytest.approx(1.0, abs=0.1) and found.choose == pytest.approx(
        1.0, abs=0.15
    )


def test_a_fit_ends_with_the_normal_equations_of_where_it_ends(
    near: Case, problem: Problem, free: tuple[Free, ...]
) -> None:
    solution = solve(problem, make_theta(near.twin), free)
    assert solution.converged and solution.system is not None
    fresh = linearise(problem, solution.theta, solution.start_states, free, solution.power)
    scale = np.sqrt(np.diag(fresh.normal))  # of a change of one deviation
    kept = solution.system
    assert np.all(np.abs(kept.normal - fresh.normal) < 0.02 * np.outer(scale, scale))
    assert np.all(np.abs(kept.gradient - fresh.gradient) < 0.05 * scale)
    spread = np.abs(kept.scores - fresh.scores).max(axis=0)
    assert np.all(spread < 0.05 * np.abs(fresh.scores).max(axis=0))


def test_a_fit_may_end_before_its_last_small_gains(
    near: Case, problem: Problem, free: tuple[Free, ...]
) -> None:
    theta = make_theta(near.twin)
    whole, rough = (solve(problem, theta, free, least_gain=gain) for gain in (CONVERGED, 0.1))
    costs = [
        compute_cost(problem, solution.start_states, solution.squares, solution.counts)
        for solution in (whole, rough)
    ]
    assert rough.converged and rough.system is not None
    assert np.any(rough.theta != whole.theta) and costs[0] < costs[1] < costs[0] + 0.1


def residuals(problem: Problem, theta: Floats, starts: Floats, power: Floats) -> Floats:
    """Return all residuals of a fit in one vector: errors of runs, then moves of starts."""
    windows = problem.windows
    set_of = np.zeros(len(windows), dtype=np.int64)
    runs = run_freely(problem.signals, theta[None], set_of, windows.begin, starts, windows.samples)
    measured, counts = gather(problem.signals, windows.begin, windows.samples)
    errors = (measured - runs[..., list(list_channels(problem.signals))]) * counts / np.sqrt(power)
    moves = (starts - windows.start_states) / problem.deviations
    return np.concatenate([errors.ravel(), -moves.ravel()])


def turned(theta: Floats, free: tuple[Free, ...], values: Floats) -> Floats:
    theta = theta.copy()
    for one, value in zip(free, values, strict=True):
        one.put(theta, value * one.size)
    return theta


def test_the_normal_equations_are_those_of_dense_differences(
    near: Case, free: tuple[Free, ...]
) -> None:
    windows = cut_windows(near.signals, near.state, 1.0).pick(np.array([2, 5, 9]))
    problem, theta = near.problem(windows), make_theta(near.twin)
    power = near.noise**2
    values = np.array([one.get(theta) / one.size for one in free])
    many = len(free)

    def all_of(z: Floats) -> Floats:
        starts = windows.start_states + z[many:].reshape(-1, 4) * problem.deviations
        return residuals(problem, turned(theta, free, z[:many]), starts, power)

    z = np.concatenate([values, np.zeros(4 * len(windows))])
    step = 1e-4
    columns = [(all_of(z - step * e) - all_of(z + step * e)) / (2 * step) for e in np.eye(len(z))]
    dense = np.stack(columns, axis=1)  # of the model: residuals fall as it rises
    normal, gradient = dense.T @ dense, dense.T @ all_of(z)
    follow = np.linalg.solve(normal[many:, many:], normal[many:, :many])
    system = linearise(problem, theta, windows.start_states, free, power)
    ours, theirs = system.normal, normal[:many, :many] - normal[:many, many:] @ follow
    scale = np.sqrt(np.diag(theirs))
    assert np.all(np.abs(ours - theirs) < 3e-3 * np.outer(scale, scale))
    reduced = gradient[:many] - follow.T @ gradient[many:]
    assert np.allclose(system.gradient, reduced, rtol=2e-3, atol=2e-3 * np.abs(reduced).max())


def test_brute_force_over_parameters_and_starts_ends_in_the_same_place(
    problem: Problem, free: tuple[Free, ...]
) -> None:
    theta = make_theta(off({"force_per_pwm_n": 1.02, "cart_viscous_n_s_m": 0.95}))
    ours = solve(problem, theta, free)
    for _ in range(3):  # a fit ends when little is to be gained; here it is to settle
        ours = solve(problem, ours.theta, free, ours.start_states)
    many = len(free)

    def all_of(z: Floats) -> Floats:
        starts = problem.windows.start_states + z[many:].reshape(-1, 4) * problem.deviations
        return residuals(problem, turned(theta, free, z[:many]), starts, ours.power)

    first = np.concatenate(
        [[one.get(theta) / one.size for one in free], np.zeros(4 * len(problem.windows))]
    )
    theirs = least_squares(all_of, first, xtol=1e-12, ftol=1e-12, gtol=1e-12)
    apart = [
        abs(one.get(ours.theta) - value * one.size) / half
        for one, value, half in zip(
            free, theirs.x[:many], compute_half_widths(ours, free), strict=True
        )
    ]
    assert max(apart) < NEAR, apart


def test_a_parameter_stays_within_its_bounds_and_the_others_make_the_best_of_it(
    problem: Problem, free: tuple[Free, ...]
) -> None:
    bound = 0.98 * true_value("force_per_pwm_n")
    held = tuple(
        replace(one, high=bound) if one.name == "force_per_pwm_n" else one for one in free
    )
    others = tuple(one for one in free if one.name != "force_per_pwm_n")
    theta = make_theta(off({"force_per_pwm_n": 0.95}))
    found = solve(problem, theta, held)
    assert held[0].get(found.theta) == bound
    theta = make_theta(off({"force_per_pwm_n": 0.98}))
    best = solve(problem, theta, others)
    for one, half in zip(others, compute_half_widths(best, others), strict=True):
        assert one.get(found.theta) == pytest.approx(one.get(best.theta), abs=0.05 * half), (
            one.name
        )


def test_the_same_problem_gives_the_same_bits(problem: Problem, free: tuple[Free, ...]) -> None:
    first, second = (solve(problem, make_theta(off(FAR)), free) for _ in range(2))
    assert np.array_equal(first.theta, second.theta) and np.array_equal(
        first.start_states, second.start_states
    )


@pytest.mark.parametrize(
    "limit", ["neighbours.RUNS_AT_ONCE", "neighbours.DRIVES_AT_ONCE", "linearised.ERRORS_AT_ONCE"]
)
def test_a_recording_taken_in_pieces_gives_the_same_equations(
    problem: Problem, free: tuple[Free, ...], monkeypatch: pytest.MonkeyPatch, limit: str
) -> None:
    theta, starts = make_theta(TRUTH), problem.windows.start_states
    late = make_theta(replace(TRUTH, effects={"input_delay": {"delay_s": 0.02}}))[None]
    whole = linearise(problem, theta, starts, free, np.ones(2), late)
    monkeypatch.setattr(f"pendulum_sysid.fitting.{limit}", 1)
    pieces = linearise(problem, theta, starts, free, np.ones(2), late)
    for name in ("normal", "scores", "start_normal", "start_gradient", "cross"):
        expected = getattr(whole, name)
        assert np.allclose(
            getattr(pieces, name), expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max()
        ), name


def test_summed_equations_are_the_sum_over_the_windows(
    problem: Problem, free: tuple[Free, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    theta, starts = make_theta(off(FAR)), problem.windows.start_states
    parts = linearise(problem, theta, starts, free, np.ones(2))
    kept = np.arange(len(starts)) % 3 > 0
    pairs = [(parts.sum_windows(kept), parts.normals[kept], parts.scores[kept])]
    for limit in (1_000_000, 1):
        monkeypatch.setattr("pendulum_sysid.fitting.linearised.ERRORS_AT_ONCE", limit)
        summed = linearise(problem, theta, starts, free, np.ones(2), summed=True)
        pairs.append((summed, parts.normals, parts.scores))
        assert np.allclose(summed.cross, parts.cross, rtol=1e-6)
    for summed, normals, scores in pairs:
        normal, gradient = normals.sum(axis=0), scores.sum(axis=0)
        assert np.allclose(summed.normal, normal, rtol=1e-9, atol=1e-9 * np.abs(normal).max())
        assert np.allclose(summed.gradient, gradient, atol=1e-9 * np.abs(gradient).max())


def test_what_the_data_do_not_fix_is_not_identifiable() -> None:
    """Without a command nothing says how strong the drive is."""
    still = made(TRUTH, 12.0, 0.0, seed=3)
    case = prepare_case([still], TRUTH)
    found = fit(case, split_windows(case.signals, case.state), (), make_theta(case.twin))
    assert not found.estimates["force_per_pwm_n"].identifiable


def test_intervals_hold_the_truth() -> None:
    inside: dict[str, list[bool]] = {}
    for seed in range(40):
        case = prepare_case([made(TRUTH, 12.0, 0.3, seed=seed)], TRUTH)
        found = fit(case, split_windows(case.signals, case.state), (), make_theta(case.twin))
        for name, one in found.estimates.items():
            inside.setdefault(name, []).append(one.low <= true_value(name) <= one.high)
    shares = {name: float(np.mean(one)) for name, one in inside.items()}
    assert len(shares) == 5 and all(0.85 <= share <= 1.0 for share in shares.values()), shares


def test_the_sandwich_is_unbiased_however_few_and_uneven_the_windows_are() -> None:
    """Known errors, 4 parameters, 7 windows, one of which carries most of the weight."""
    random, free = (
        np.random.default_rng(4),
        tuple(Free(name, "", (k,), (1.0,), -9.0, 9.0, 1.0) for k, name in enumerate("abcd")),
    )
    design = random.standard_normal((7, 10, 4)) * np.array([3.0, 1, 1, 1, 1, 1, 1])[:, None, None]
    normals = design.transpose(0, 2, 1) @ design
    inverse = np.linalg.inv(normals.sum(axis=0))
    found = []
    for _ in range(4000):
        off = 2.0 * random.standard_normal(
            (7, 10)
        )  # twice as large as the classical width takes them to be
        best = inverse @ np.einsum("wsk,ws->k", design, off)
        scores = np.einsum("wsk,ws->wk", design, off - design @ best)
        nothing = np.zeros(4)
        system = make_reduced_system(normals, scores)
        solution = Solution(nothing, nothing, nothing, nothing, True, system)
        found.append((compute_half_widths(solution, free) / student.ppf(0.975, 6)) ** 2)
    ratios = np.mean(found, axis=0) / (4.0 * np.diag(inverse))
    assert np.all(np.abs(ratios - 1) < 0.08), ratios  # the classical width as the least lifts some


def test_a_direction_that_one_window_alone_fixes_has_the_classical_width() -> None:
    free = tuple(Free(name, "", (k,), (1.0,), -9.0, 9.0, 1.0) for k, name in enumerate("ab"))
    normals = np.array([np.diag([1.0, 0.0])] * 5 + [np.diag([1.0, 4.0])])
    nothing = np.zeros(2)
    scores = np.zeros((6, 2))
    system = make_reduced_system(normals, scores)
    found = compute_half_widths(Solution(nothing, nothing, nothing, nothing, True, system), free)
    assert found == pytest.approx(student.ppf(0.975, 5) * np.sqrt([1 / 6, 1 / 4]))


def test_parameters_that_the_data_fix_only_together_are_correlated() -> None:
    """The sum of two parameters is seen in every window, their difference in none but a little."""
    free = tuple(Free(name, "", (k,), (1.0,), -9.0, 9.0, 1.0) for k, name in enumerate("abc"))
    together = np.array([[1.0, 0.99, 0.0], [0.99, 1.0, 0.0], [0.0, 0.0, 1.0]])
    random, scores = np.random.default_rng(5), np.empty((400, 3))
    scores[:] = random.standard_normal((400, 3)) @ np.linalg.cholesky(together).T
    system = make_reduced_system(np.array([together] * 400), scores)
    nothing = np.zeros(3)
    solution = Solution(nothing, nothing, nothing, nothing, True, system)
    values = compute_correlations(solution, free)
    assert np.diag(values) == pytest.approx(1.0)
    assert values[0, 1] < -0.98 and values[1, 0] == values[0, 1] and abs(values[0, 2]) < 0.2


def test_a_start_that_leaves_all_bounds_is_not_converged() -> None:
    wild = replace(INTECO, rig=replace(INTECO.rig, cart_viscous_n_s_m=1e4))
    case = prepare_case([made(INTECO, 6.0)], wild)
    fitted = fit(case, split_windows(case.signals, case.state), (), make_theta(wild))
    assert not fitted.converged
    assert np.isfinite(fitted.train)
