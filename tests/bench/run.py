"""The benchmarks: each figure beside its peer's, measured in turn in the same run.

Everything runs in one thread.
Figures are medians; the machine may be busy, so trust the ratios more than the figures.
"""

import argparse
import os
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np
import peers
from rows import Row, format_table
from scipy.optimize import minimize

from pendulum_twin import kernel
from pendulum_twin.free_runs import run_freely
from pendulum_twin.laws.law import Law
from pendulum_twin.mechanics import run_mechanics
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import BASE, make_theta
from pendulum_twin.rig import Rig
from pendulum_twin.signals import Signals
from pendulum_twin.stepper import Stepper

REPEATS = 5
RIG = Rig(0.5723, 0.12, 0.01955717, 0.00292, 9.81, 12.86, 0.5, 0.00027344, 0.9, 0.5)
COULOMB = {"cart_coulomb_friction": {"level_n": 1.2}}
GYMNASIUM, MUJOCO = "Gymnasium CartPole (1 Euler step)", "MuJoCo (30 RK4 steps)"
START = np.array([0.0, 2.6, 0.0, 0.1])


def time_functions(*functions: Callable[[], object], repeats: int = REPEATS) -> list[float]:
    """Return each function's median duration, s; they take turns on the same machine."""
    for function in functions:
        function()  # compile, fill caches
    taken: list[list[float]] = [[] for _ in functions]
    for _ in range(repeats):
        for function, durations in zip(functions, taken, strict=True):
            begin = time.perf_counter()
            function()
            durations.append(time.perf_counter() - begin)
    return [statistics.median(durations) for durations in taken]


def make_kernel_steps(
    effects: dict, starts: np.ndarray, command: np.ndarray, laws: dict[str, Law] | None = None
) -> Callable[[], np.ndarray]:
    """Return a function that runs pendulums through control steps of 30 ms (30 of 1 ms)."""
    lanes = len(starts)
    theta = np.tile(make_theta(Twin("bench", RIG, effects, laws or {})), (lanes, 1))
    drives = np.repeat(command, peers.SUBSTEPS)[None]
    first, out = np.zeros(lanes, dtype=np.int64), np.empty((lanes, len(command) + 1, 4))

    def run() -> np.ndarray:
        run_mechanics(drives, first, first, first, starts, theta, 1e-3, peers.SUBSTEPS, out)
        return out[:, 1:]

    return run


def bench_kernel() -> list[Row]:
    """Control steps a second: alone, and many pendulums together."""
    rows = []
    for lanes, ours, gyms, mujocos in (
        (1, 20_000, 2_000, 60),
        (16, 10_000, 2_000, 5),
        (1024, 200, 300, 1),
    ):
        starts = START + np.array([0.0, 0.003, 0.0, 0.0]) * np.arange(lanes)[:, None]
        command = 0.3 * np.sin(0.2 * np.arange(ours))
        theirs = peers.make_mujoco_steps(RIG, starts, command[:mujocos])
        np.testing.assert_allclose(
            theirs(), make_kernel_steps({}, starts, command[:mujocos])(), atol=1e-9
        )
        base, dry, gym, mujoco = time_functions(
            make_kernel_steps({}, starts, command),
            make_kernel_steps(COULOMB, starts, command),
            peers.make_gymnasium_steps(lanes, gyms),
            theirs,
        )
        fast = lanes * ours / np.array([base, dry])
        slow = lanes * np.array([gyms / gym, mujocos / mujoco])
        group = f"{lanes} pendulum{'s' * (lanes > 1)}"
        for rate, model in zip(fast, ("base model", "with Coulomb friction"), strict=True):
            for peer_rate, peer in zip(
                slow, ("Gymnasium CartPole (1 Euler step)", "MuJoCo (30 RK4 steps)"), strict=True
            ):
                what = f"control steps/s, {group}, {model}"
                rows.append(Row(what, f"{rate:,.0f}", peer, f"{peer_rate:,.0f}", rate / peer_rate))
    return rows


def bench_laws() -> list[Row]:
    """Measured laws: the same pendulums with a law beside those without."""
    starts = START + np.array([0.0, 0.003, 0.0, 0.0]) * np.arange(16)[:, None]
    command = 0.3 * np.sin(0.2 * np.arange(2000))
    along, ways = np.linspace(-0.45, 0.45, 20), np.geomspace(1e-4, 1e-2, 20)
    curve = Law(tuple(along), tuple(0.2 * np.sin(9.0 * along)))
    two = Law(tuple(ways), tuple(0.3 * np.isin(np.arange(20), (4, 11))))
    many = Law(tuple(ways), (0.03,) * 20)
    laws: dict[str, dict[str, Law]] = {
        "a curve of 20 knots": {"cart_force_by_position": curve},
        "hysteresis of 2 elements": {"cart_hysteresis": two},
        "hysteresis of 20 elements": {"cart_hysteresis": many},
    }
    runs = [make_kernel_steps(COULOMB, starts, command, law) for law in ({}, *laws.values())]
    plain, *slower = 16 * 2000 / np.array(time_functions(*runs, repeats=51))
    peer = "the same without the law"
    return [
        Row(f"control steps/s, {name}", f"{rate:,.0f}", peer, f"{plain:,.0f}", rate / plain)
        for name, rate in zip(laws, slower, strict=True)
    ]


def bench_step() -> list[Row]:
    """One step of the live twin, 10 ms, called from Python."""
    rows, gym = [], peers.make_gymnasium_steps(1, 1000)
    for name, effects in (("base model", {}), ("with Coulomb friction", COULOMB)):
        stepper = Stepper(Twin("bench", RIG, effects), 0.01)

        def run(stepper: Stepper = stepper) -> None:
            stepper.reset()
            for _ in range(1000):
                stepper.step(0.1)

        ours, theirs = time_functions(run, gym)
        what = f"one Python call for 10 ms, {name}"
        rows.append(
            Row(
                what,
                f"{ours * 1e3:.1f} us",
                GYMNASIUM,
                f"{theirs * 1e3:.1f} us",
                theirs / ours,
            )
        )
    return rows


def make_recording(
    seconds: float = 120.0, effects: dict | None = None, noise: bool = False
) -> Signals:
    """Return a recording at 100 Hz of a rig that is driven up and down the rail.

    noise: whether positions are rounded as encoders do.
    """
    samples = round(seconds / 0.01)
    t = 0.01 * np.arange(samples)
    command = 0.25 * np.sin(4.0 * t) * np.sin(0.31 * t) + 0.15 * np.sign(np.sin(1.7 * t))
    valid = np.ones(samples, dtype=bool)
    empty = Signals(0.01, command, 0.0 * t, 0.0 * t, valid, valid)
    theta, first = make_theta(Twin("truth", RIG, effects or {}))[None], np.zeros(1, dtype=np.int64)
    states = run_freely(empty, theta, first, first, START[None], samples)[0]
    grains = (1e-4, 2 * np.pi / 4096) if noise else (1e-12, 1e-12)
    cart, pole = (np.round(states[:, k] / grain) * grain for k, grain in enumerate(grains))
    return Signals(0.01, command, cart, pole, valid, valid)


def bench_cost() -> list[Row]:
    """Cost of a recording of 120 s: a run, a block of 16 parameter sets, windows of 1 s."""
    signals = make_recording()
    theta, first = make_theta(Twin("bench", RIG))[None], np.zeros(1, dtype=np.int64)
    sixteen = np.repeat(theta, 16, axis=0)
    sixteen[:, : len(BASE)] *= 1 + 1e-6 * np.arange(16)[:, None]
    begin = np.arange(0, len(signals) - 100, 100)
    starts = np.tile(START, (len(begin), 1))
    zeros = np.zeros(16, dtype=np.int64)
    alone, block, windows, scipy = time_functions(
        lambda: run_freely(signals, theta, first, first, START[None], len(signals)),
        lambda: run_freely(
            signals, sixteen, np.arange(16), zeros, np.tile(START, (16, 1)), len(signals)
        ),
        lambda: run_freely(
            signals, theta, np.zeros(len(begin), dtype=np.int64), begin, starts, 101
        ),
        peers.make_scipy_run(RIG, START, signals.command, signals.period_s),
    )
    ours = (
        ("one run", alone),
        ("one of a block of 16 parameter sets", block / 16),
        ("in windows of 1 s", windows),
    )
    return [
        Row(
            f"cost of 120 s, 1 ms steps, {what}",
            f"{t * 1e3:.2f} ms",
            "SciPy solve_ivp",
            f"{scipy * 1e3:.0f} ms",
            scipy / t,
        )
        for what, t in ours
    ]


TRUTH = {
    "motor_lag": {"time_constant_s": 0.02},
    "cart_stribeck_friction": {"level_n": 0.8, "static_n": 0.3, "velocity_m_s": 0.1},
    "rail_tilt": {"angle_rad": 0.01},
    "pole_quadratic_drag": {"n_m_s2": 2e-5},
    "angle_offset": {"angle_rad": 0.02},
}


def bench_fit() -> list[Row]:
    """A fit of 12 parameters to 120 s: beside Nelder-Mead on the same windows and kernel."""
    from pendulum_sysid.cleaning.smooth_state import smooth_state
    from pendulum_sysid.fitting.gauss_newton import solve
    from pendulum_sysid.fitting.parameters import compute_scales, list_free_parameters
    from pendulum_sysid.fitting.problem import Problem
    from pendulum_sysid.fitting.windows import cut_windows, gather, list_channels

    signals = make_recording(effects=TRUTH, noise=True)
    state = smooth_state(signals)
    windows = cut_windows(signals, state, 1.0)
    wrong = Rig(0.5723, 0.12, 0.022, 0.0035, 9.81, 10.0, 1.0, 0.0006, 0.9, 0.5)
    believed = Twin(
        "bench", wrong, {name: dict.fromkeys(values, 0.01) for name, values in TRUTH.items()}
    )
    start = make_theta(believed)
    free = list_free_parameters(believed, tuple(TRUTH), compute_scales(signals, state, start))
    measured, _ = gather(signals, windows.begin, windows.samples)
    set_of = np.zeros(len(windows), dtype=np.int64)

    def compute_cost(scaled: np.ndarray) -> float:
        theta = start.copy()
        for parameter, value in zip(free, scaled, strict=True):
            clipped = np.clip(value * parameter.size, parameter.low, parameter.high)
            parameter.put(theta, float(clipped))
        runs = run_freely(
            signals, theta[None], set_of, windows.begin, windows.start_states, windows.samples
        )
        errors = measured - runs[..., list(list_channels(signals))]
        return float(np.sum(np.log(np.mean(errors**2, axis=(0, 1)))))

    begin = np.array([p.get(start) / p.size for p in free])
    problem = Problem(signals, windows, state.deviations)
    (ours,) = time_functions(lambda: solve(problem, start, free))
    solution = solve(problem, start, free)
    before = time.perf_counter()
    simplex = minimize(compute_cost, begin, method="Nelder-Mead", options={"maxfev": 2000})
    theirs = time.perf_counter() - before
    truth = make_theta(Twin("truth", RIG, TRUTH))
    wanted = np.array([p.get(truth) for p in free])

    def measure_error(values: np.ndarray) -> float:
        return float(np.median(np.abs(values / wanted - 1)))

    error = measure_error(np.array([p.get(solution.theta) for p in free]))
    peer_error = measure_error(simplex.x * np.array([p.size for p in free]))
    peer = f"SciPy Nelder-Mead, {simplex.nfev} runs, once"
    what = f"fit of {len(free)} parameters to 120 s"
    return [
        Row(what, f"{ours:.2f} s", peer, f"{theirs:.1f} s", theirs / ours),
        Row(
            f"{what}: median error",
            f"{error:.2%}",
            peer,
            f"{peer_error:.2%}",
            peer_error / error,
        ),
    ]


def bench_graph() -> list[Row]:
    """The twin on the ROS graph: lockstep and jitter (graph.py by itself listens longer)."""
    from graph import measure  # brings ROS, whose threads would disturb the others

    return measure(steps=2000, jitter_s=20.0)


BENCHES = {
    "kernel": bench_kernel,
    "laws": bench_laws,
    "step": bench_step,
    "cost": bench_cost,
    "fit": bench_fit,
    "graph": bench_graph,
}


def main() -> None:
    """Measure what is asked for, or everything, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", choices=list(BENCHES), default=list(BENCHES))
    names = parser.parse_args().only
    begin = time.perf_counter()
    rows = []
    for bench in (BENCHES[name] for name in names):
        print(f"{(bench.__doc__ or '').split(':')[0].rstrip('.')} ...", file=sys.stderr)
        rows += bench()
    print(format_table(rows))
    print(
        f"\nOne thread, blocks of {kernel.WIDTH} pendulums, medians of {REPEATS}; "
        "the ratio says how many times better this twin is, or how near the bare graph it comes. "
        f"{time.perf_counter() - begin:.0f} s."
    )


ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")

if __name__ == "__main__":
    if (
        not ONE_THREAD.items() <= os.environ.items()
    ):  # libraries read these when they are loaded: begin again
        os.execve(sys.executable, [sys.executable, *sys.argv], os.environ | ONE_THREAD)
    main()
