"""Replay: known errors come out as they are, and a wrong twin never looks right."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.made_recordings import (
    CART_NOISE_M,
    INTECO,
    POLE_NOISE_RAD,
    made,
    made_states,
    without_joint,
)

from pendulum_sysid.fitting.compare import Pair, compare, compare_two
from pendulum_sysid.fitting.whole_run import compute_equation_29, run_whole
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.fitting.windows import cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording, Windows
from pendulum_sysid.telling.compare_plot import draw_comparison
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals, join_signals

STRONGER = replace(INTECO, rig=replace(INTECO.rig, force_per_pwm_n=1.2 * 12.86))
FALLS_APART = replace(
    INTECO, rig=replace(INTECO.rig, cart_viscous_n_s_m=1e4)
)  # friction that stops the cart within 70 us, far below the integrator's step


@pytest.fixture(scope="module")
def recording() -> Recording:
    return made(INTECO)


def window_runs(measured, runs, counts) -> WindowRuns:
    return WindowRuns((0, 1), np.zeros(1), 0.01, measured, runs, counts, np.array([2.0, 4.0]))


def test_the_better_twin_of_a_window_is_so_in_units_of_noise() -> None:
    """2 m of a sensor whose noise is 2 m are more than 3 rad of noise of 4 rad."""
    measured, counts = np.zeros((2, 1, 2)), np.ones((2, 1, 2))
    cart_off, pole_off = np.array([[2.0, 0.0]]), np.array([[0.0, 3.0]])
    first = window_runs(measured, np.stack([cart_off, pole_off]), counts)
    second = window_runs(measured, np.stack([pole_off, pole_off]), counts)
    assert Pair((None, None), (first, second)).second_better == 1  # type: ignore[arg-type]
    assert Pair((None, None), (second, first)).second_better == 0  # type: ignore[arg-type]


def test_score_of_the_true_twin_from_its_true_starts_is_one(recording: Recording) -> None:
    case = prepare_case([recording], INTECO)
    windows = cut_windows(case.signals, case.state, 0.5)
    true = made_states(INTECO, recording.signals.command)
    runs = run_windows(case, Windows(windows.begin, windows.samples, true[windows.begin]))
    assert runs.score == pytest.approx(1.0, abs=0.05)
    assert runs.rmse == pytest.approx([CART_NOISE_M, POLE_NOISE_RAD], rel=0.05)


def test_smoothed_starts_cost_the_true_twin_little_and_a_wrong_one_loses(
    recording: Recording,
) -> None:
    true, wrong = (
        compare(prepare_case([recording], INTECO)),
        compare(prepare_case([recording], STRONGER)),
    )
    assert true.seconds == 1.0 and true.count == 38  # 20 s, every 0.5 s
    assert 1.0 < true.score < 10.0
    assert true.noise_floor == pytest.approx(true.score, rel=0.3)  # the true twin is at its floor
    assert wrong.score > 10.0 * true.score
    assert wrong.cart_rmse_m > 10.0 * true.cart_rmse_m


def test_without_noise_the_true_twin_makes_next_to_no_error() -> None:
    found = compare(prepare_case([made(INTECO, noise=0.0)], INTECO))
    assert found.cart_rmse_m < 1e-4 and found.pole_rmse_rad < 2e-4 and found.thesis_rmse < 1e-4


def test_equation_29_of_the_true_twin_is_near_the_noise(recording: Recording) -> None:
    noise = 0.75 * CART_NOISE_M + 0.25 * 2 * POLE_NOISE_RAD
    assert compare(prepare_case([recording], INTECO)).thesis_rmse < 10.0 * noise
    assert compare(prepare_case([recording], STRONGER)).thesis_rmse > 100.0 * noise


@pytest.mark.parametrize(
    ("gone", "expected"),
    [(None, 0.75 * 0.2 + 0.25 * (1.0 + 1.0)), ("pole", 0.2), ("cart", 1.0 + 1.0)],
)
def test_equation_29_by_hand(gone: str | None, expected: float) -> None:
    n = 5
    held = {"cart": np.full(n, 0.3), "pole": np.zeros(n)} | ({gone: None} if gone else {})
    signals = Signals(
        0.01, np.zeros(n), held["cart"], held["pole"], np.ones(n, bool), np.ones(n, bool)
    )
    run = np.zeros((n, 4))
    run[:, 0], run[:, 1] = 0.1, np.pi / 2  # sine off by 1, cosine off by 1
    assert compute_equation_29(signals, run) == pytest.approx(expected)


def test_samples_that_are_not_valid_do_not_count() -> None:
    n = 4
    valid = np.array([True, False, True, True])
    signals = Signals(
        0.01, np.zeros(n), np.array([1.0, 99.0, 1.0, 1.0]), np.zeros(n), valid, np.ones(n, bool)
    )
    assert compute_equation_29(signals, np.zeros((n, 4))) == pytest.approx(0.75)
    measured, counts = np.ones((1, 3, 2)), np.ones((1, 3, 2))
    measured[0, 1, 0], counts[0, 1, 0] = 99.0, 0.0
    runs = window_runs(measured, np.zeros((1, 3, 2)), counts)
    assert runs.rmse == pytest.approx([1.0, 1.0])
    assert runs.score == pytest.approx(np.sqrt((2 * 0.25 + 3 * 0.0625) / 5))


def test_each_stretch_is_run_by_itself() -> None:
    parts = [made(INTECO, 6.0, seed=1).signals, made(INTECO, 4.0, 0.15, seed=2).signals]
    cases = [prepare_case([Recording("part", "", part)], INTECO) for part in parts]
    case = prepare_case([Recording("both", "", join_signals(parts))], INTECO)
    theta = make_theta(INTECO)
    states = np.concatenate([one.state.states for one in cases])
    alone = [run_whole(one.signals, one.state.states, theta) for one in cases]
    assert np.array_equal(run_whole(case.signals, states, theta), np.concatenate(alone))
    assert compare(case).count == 10 + 6  # none across the break
    assert compare(case).thesis_rmse < 0.005


@pytest.mark.parametrize(("gone", "left"), [("pole", "cart_rmse_m"), ("cart", "pole_rmse_rad")])
def test_a_recording_of_one_joint(recording: Recording, gone: str, left: str) -> None:
    # The cart alone is not the same body, so what is checked is what is reported.
    found = compare(prepare_case([without_joint(recording, gone)], INTECO))
    other = {"cart_rmse_m", "pole_rmse_rad"} - {left}
    assert getattr(found, left) > 0.0
    assert getattr(found, other.pop()) is None
    assert np.isfinite([found.score, found.thesis_rmse]).all()


def test_a_run_that_diverges_is_infinite_and_nothing_else_breaks(recording: Recording) -> None:
    found = compare(prepare_case([recording], FALLS_APART))
    assert found.score == found.thesis_rmse == found.cart_rmse_m == np.inf
    assert found.noise_floor is None


def test_a_recording_too_short_is_refused() -> None:
    with pytest.raises(
        BadInputError, match=r"at least one stretch of 1 s .* found none in 0\.6 s: record longer"
    ):
        compare(prepare_case([made(INTECO, 0.6)], INTECO))


def test_a_twin_without_the_recorded_joint_is_refused(recording: Recording) -> None:
    keys = ("pole_mass_kg", "com_distance_m", "pole_inertia_kg_m2", "pole_viscous_n_m_s")
    cart_alone = Twin("cart", replace(INTECO.rig, **dict.fromkeys(keys)))
    with pytest.raises(BadInputError, match="expected a twin with a pole"):
        compare(prepare_case([recording], cart_alone))


def test_two_twins_run_on_the_same_windows(recording: Recording) -> None:
    pair = compare_two(prepare_case([recording], STRONGER), INTECO)
    assert pair.comparisons == (
        compare(prepare_case([recording], STRONGER)),
        compare(prepare_case([recording], INTECO)),
    )
    assert pair.second_better == pair.comparisons[0].count
    assert np.array_equal(pair.runs[0].measured, pair.runs[1].measured)


@pytest.mark.parametrize("twin", [STRONGER, FALLS_APART], ids=["wrong", "diverging"])
def test_the_picture_is_written_whole(recording: Recording, twin: Twin, tmp_path: Path) -> None:
    pair = compare_two(prepare_case([recording], twin), INTECO)
    draw_comparison(tmp_path / "plot.svg", "made", ("first.yaml", "second.yaml"), pair.runs)
    text = (tmp_path / "plot.svg").read_text()
    assert text.rstrip().endswith("</svg>")
    assert [path.name for path in tmp_path.iterdir()] == ["plot.svg"]


def test_a_picture_of_another_kind_is_refused(recording: Recording, tmp_path: Path) -> None:
    pair = compare_two(prepare_case([recording], INTECO), INTECO)
    with pytest.raises(BadInputError, match=r"ending in \.png or \.svg or \.pdf, found \.txt"):
        draw_comparison(tmp_path / "plot.txt", "made", ("a", "b"), pair.runs)


def test_a_gap_does_not_set_the_clock_back() -> None:
    """The rig's gain falls from its start on; the run after the gap begins later in time."""
    drifting = replace(INTECO, effects={"gain_drift": {"per_s": -0.03}})
    recording = made(drifting, 20.0, 0.2, noise=0.0)
    divided = recording.signals.break_at([1000])
    states = made_states(drifting, recording.signals.command)
    whole = run_whole(divided, states, make_theta(drifting))
    np.testing.assert_allclose(whole[1000:1300, 0], states[1000:1300, 0], atol=1e-6)
