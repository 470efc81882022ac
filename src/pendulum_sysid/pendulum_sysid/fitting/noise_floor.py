"""The score of a perfect model: the twin judged on recordings that the twin itself made."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.case import Case, make_case
from pendulum_sysid.fitting.gauss_newton import refine_start_states
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.free_runs import run_freely
from pendulum_twin.signals import Signals

TRIES = 5


@dataclass(frozen=True)
class NoiseFloor:
    """Hold what a perfect model reaches, in units of the sensors' noise.

    score: over all windows.
    typical: the error of the median window.
    """

    score: float
    typical: float


def measure_noise_floor(
    case: Case, theta: Floats, windows: Windows, seed: int = 0
) -> NoiseFloor | None:
    """Measure what the case's twin reaches on its own noisy runs through the same windows.

    theta: (SIZE,) of the case's twin.
    windows: the windows that the floor is for.
    seed: of the noise.

    None where it cannot be measured: the twin's own runs leave all bounds, or no window is given.

    The runs follow the recording as near as the twin can: near upright, a run from the smoothed
    start falls away from a pole that a controller holds, and ends where noise matters little. They
    are smoothed and replayed as recordings are. The floor lies above 1 by what the noise
    in the smoothed start states costs. It is the root mean square over several draws of the noise.
    """
    signals = case.signals
    if not len(windows):
        return None
    stretch = np.searchsorted(signals.stretch_begins, windows.begin, side="right") - 1
    before = windows.begin - np.array(signals.stretch_begins)[stretch]
    # where all windows stand near the start of their stretch, their starts are smoothed from less
    lead = min(round(decisions.FLOOR_LEAD_S / signals.period_s), int(before.max()))
    begin = windows.begin[before >= lead] - lead
    length = lead + windows.samples
    # What command and cart did before a piece is unknown there: to the runs that make the perfect
    # recording, and to the runs that are judged by it.
    pieces = signals.cut([(first, first + length) for first in begin.tolist()])
    motion = Windows(np.array(pieces.stretch_begins), length, case.state.states[begin])
    problem = replace(case.problem(motion), signals=pieces)
    starts = refine_start_states(problem, theta).start_states
    set_of = np.zeros(len(begin), dtype=np.int64)
    runs = run_freely(pieces, theta[None], set_of, motion.begin, starts, length)
    if not np.all(np.isfinite(runs)):
        return None  # a twin that leaves all bounds says nothing about what is possible
    tries = [
        _replay_perfect(case, pieces, runs, lead, np.random.default_rng((seed, k)))
        for k in range(TRIES)
    ]
    score, typical = (
        np.sqrt(np.mean(np.square(v)))
        for v in zip(*((t.score, t.typical) for t in tries), strict=True)
    )
    return NoiseFloor(float(score), float(typical))


def _replay_perfect(
    case: Case, pieces: Signals, runs: Floats, lead: int, random: np.random.Generator
) -> WindowRuns:
    """Return free runs of the case's twin on a recording that is made of noisy runs of it.

    pieces: of the recording, a stretch for each run.
    runs: (windows, n, 4) without noise; each holds its window after the lead.
    lead: samples of a run before its window.
    """
    positions = []
    for k, (there, noise) in enumerate(
        ((pieces.cart, case.state.noise.cart_m), (pieces.pole, case.state.noise.pole_rad))
    ):
        noiseless = runs[..., k].reshape(-1)
        positions.append(
            None
            if there is None or noise is None
            else noiseless + random.normal(0.0, noise, len(noiseless))
        )
    every = np.ones(len(pieces), dtype=bool)
    perfect = replace(
        pieces, cart=positions[0], pole=positions[1], cart_valid=every, pole_valid=every
    )
    state = smooth_state(perfect)
    perfect_case = make_case(
        replace(case.recording, signals=perfect, doubt=None), state, case.twin
    )
    begin = np.array(pieces.stretch_begins) + lead
    windows = Windows(begin, runs.shape[1] - lead, perfect_case.state.states[begin])
    return run_windows(perfect_case, windows)
