"""The noise floor is measured wherever windows are, and otherwise not said to be 1."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.fitting.windows import cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Windows
from pendulum_sysid.telling.likeness import compute_floor_ratio, compute_floors, is_unlike
from pendulum_sysid.telling.outcome import Findings
from pendulum_twin.laws.law import Law
from pendulum_twin.parameter_vector import FORCE_PER_PWM, make_theta

LAW = Law((0.05, 0.1, 0.2), (0.0, 0.3, 0.0))
REMEMBERING = replace(INTECO, measured_laws={"cart_hysteresis": LAW})


@pytest.fixture(scope="module")
def case() -> Case:
    return prepare_case([made(INTECO)], INTECO)


def pick(windows: Windows, kept: slice) -> Windows:
    return Windows(windows.begin[kept], windows.samples, windows.start_states[kept])


def test_a_true_twin_is_at_its_floor(case: Case) -> None:
    windows = cut_windows(case.signals, case.state, 0.5)
    floor = measure_noise_floor(case, make_theta(INTECO), windows)
    assert floor is not None
    assert floor.score == pytest.approx(run_windows(case, windows).score, rel=0.3)


def test_a_twin_that_remembers_its_path_is_at_its_floor() -> None:
    """The floor was 37 times the score: the perfect model did not know the path."""
    case = prepare_case([made(REMEMBERING)], REMEMBERING)
    windows = cut_windows(case.signals, case.state, 0.5)
    floor = measure_noise_floor(case, make_theta(REMEMBERING), windows)
    assert floor is not None
    assert floor.score == pytest.approx(run_windows(case, windows).score, rel=0.5)


def test_a_window_at_the_start_of_its_stretch_has_a_floor_of_its_own(case: Case) -> None:
    """It was said to be 1, the least there is, so that a perfect model stood far above it."""
    windows = pick(cut_windows(case.signals, case.state, 0.5), slice(0, 1))
    assert windows.begin[0] == 0
    floor = measure_noise_floor(case, make_theta(INTECO), windows)
    assert floor is not None
    assert 1.0 < floor.typical < 100.0
    assert floor.score == pytest.approx(run_windows(case, windows).score, rel=2.0)


def test_what_cannot_be_measured_is_none(case: Case) -> None:
    windows = cut_windows(case.signals, case.state, 0.5)
    assert measure_noise_floor(case, make_theta(INTECO), pick(windows, slice(0, 0))) is None
    endless = make_theta(INTECO)
    endless[FORCE_PER_PWM] = 1e308
    with np.errstate(all="ignore"):
        assert measure_noise_floor(case, endless, windows) is None


def test_without_a_floor_nothing_is_said_to_be_at_the_noise(case: Case) -> None:
    windows = cut_windows(case.signals, case.state, 0.5)
    runs = {part: run_windows(case, windows) for part in ("train", "held_out")}
    blank = dict.fromkeys(Findings.__dataclass_fields__)
    findings = Findings(**{**blank, "before": runs, "after": runs})  # type: ignore[arg-type]
    best = type("Best", (), {"choose": 9.0, "effects": ()})()
    findings = replace(findings, case=case, best=best, floor=None, named=(), with_laws=None)
    assert is_unlike(findings)
    assert math.isinf(compute_floor_ratio(findings))
    assert math.isinf(compute_floors(findings).after)
