"""The score of a perfect model: the twin judged on recordings that the twin itself made."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.own_runs import record_runs, run_own
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.records import Fit, Split, Windows
from pendulum_twin.arrays import Floats
from pendulum_twin.signals import Signals

TRIES = 5
SEED = 0  # of the noise


@dataclass(frozen=True)
class NoiseFloor:
    """Hold what a perfect model reaches, in units of the sensors' noise.

    score: over all windows.
    typical: the error of the median window.
    """

    score: float
    typical: float


def measure_noise_floor(case: Case, theta: Floats, windows: Windows) -> NoiseFloor | None:
    """Measure what the case's twin reaches on its own noisy runs through the same windows.

    theta: (SIZE,) of the case's twin.
    windows: the windows that the floor is for.

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
    pieces, runs = run_own(case, theta, Windows(begin, length, case.state.states[begin]))
    if not np.all(np.isfinite(runs)):
        return None  # a twin that leaves all bounds says nothing about what is possible
    tries = [
        _replay_perfect(case, pieces, runs, lead, np.random.default_rng((SEED, k)))
        for k in range(TRIES)
    ]
    score, typical = (
        np.sqrt(np.mean(np.square(v)))
        for v in zip(*((t.score, t.typical) for t in tries), strict=True)
    )
    return NoiseFloor(float(score), float(typical))


def is_at_noise(case: Case, split: Split, fit: Fit, floor: NoiseFloor | None) -> bool:
    """Return whether a fit is at the noise, on windows that it has not seen, too.

    Laws that were chosen by cross-validation can be there without what they stand for.

    floor: what a perfect model reaches on the held-out windows; None where that is not known.
    """
    if floor is None or fit.choose > decisions.MISFIT_AT_NOISE:
        return False
    held_out = run_windows(replace(case, twin=fit.twin), split.held_out)
    return held_out.typical <= decisions.FLOORS_AT_NOISE * floor.typical


def _replay_perfect(
    case: Case, pieces: Signals, runs: Floats, lead: int, random: np.random.Generator
) -> WindowRuns:
    """Return free runs of the case's twin on a recording that is made of noisy runs of it.

    pieces: of the recording, a stretch for each run.
    runs: (windows, n, 4) without noise; each holds its window after the lead.
    lead: samples of a run before its window.
    """
    perfect_case = record_runs(case, pieces, runs, random)
    begin = np.array(pieces.stretch_begins) + lead
    windows = Windows(begin, runs.shape[1] - lead, perfect_case.state.states[begin])
    return run_windows(perfect_case, windows)
