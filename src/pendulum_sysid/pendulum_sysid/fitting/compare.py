"""Judge twins by their free runs on a recording: on windows, and over the whole of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fitting.case import Case, change_twin
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.whole_run import compute_equation_29, run_whole
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.records import Comparison, Windows
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta

EVERY_S = 0.5


@dataclass(frozen=True)
class Pair:
    """Hold how two twins do on the same windows of one recording, the first twin first.

    Attributes:
        comparisons: what `replay` says of each twin.
        runs: their runs through the windows, and the squared errors of these.
    """

    comparisons: tuple[Comparison, Comparison]
    runs: tuple[WindowRuns, WindowRuns]

    @property
    def second_better(self) -> int:
        """Return in how many windows the second twin's errors are smaller, in units of noise."""
        first, second = ((runs.squares / runs.noise**2).sum(axis=1) for runs in self.runs)
        return int(np.sum(second < first))


def compare(case: Case) -> Comparison:
    """Replay the case's twin on its recording, as `sysid replay` does.

    Windows of 1 s start every 0.5 s, each from a state smoothed out of the recording alone;
    samples that are not valid do not count. A run that diverges makes its errors infinite. Raises
    UnusableRecording when the recording holds no usable window.
    """
    windows = _cut(case)
    return _make_comparison(case, windows, run_windows(case, windows))


def compare_two(case: Case, twin: Twin) -> Pair:
    """Compare the case's twin with another on the same windows; raises what `compare` does."""
    cases = case, change_twin(case, twin)
    windows = _cut(case)
    runs = run_windows(cases[0], windows), run_windows(cases[1], windows)
    first, second = (
        _make_comparison(each, windows, ran) for each, ran in zip(cases, runs, strict=True)
    )
    return Pair((first, second), runs)


def _cut(case: Case) -> Windows:
    windows = cut_windows(case.signals, case.state, EVERY_S)
    if not len(windows):
        raise UnusableRecording(
            f"expected at least one stretch of {WINDOW_S:g} s with half of its samples valid, "
            "found none in "
            f"{case.signals.seconds:.3g} s: record longer"
        )
    return windows


def _make_comparison(case: Case, windows: Windows, runs: WindowRuns) -> Comparison:
    theta = make_theta(case.twin)
    whole = run_whole(case.signals, case.state.states, theta)
    floor = measure_noise_floor(case, theta, windows) if np.isfinite(runs.score) else None
    return Comparison(
        seconds=WINDOW_S,
        count=len(runs),
        cart_rmse_m=runs.of_joint(0, runs.rmse),
        pole_rmse_rad=runs.of_joint(1, runs.rmse),
        score=runs.score,
        noise_floor=None if floor is None else floor.score,
        thesis_rmse=compute_equation_29(case.signals, whole),
    )
