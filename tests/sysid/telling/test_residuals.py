"""What errors still show: white errors are called white, and what the command explains is told."""

import numpy as np
import pytest

from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.telling.likeness import compute_fit, compute_followed_share
from pendulum_sysid.telling.residuals import examine_residuals

WINDOWS, SAMPLES, PERIOD_S = 40, 101, 0.01
RNG = np.random.default_rng(3)
COMMAND = RNG.normal(size=(WINDOWS, SAMPLES + 20))
MOTION = np.sin(np.arange(SAMPLES) / 9.0) * np.linspace(0.1, 0.4, WINDOWS)[:, None]


def make_runs(errors: np.ndarray, noise: float = 1e-3) -> WindowRuns:
    """Return runs of a cart whose measurement minus run is given, (windows, samples)."""
    return WindowRuns(
        channels=(0,),
        begin_s=np.arange(WINDOWS) * 1.0,
        period_s=PERIOD_S,
        measured=MOTION[..., None],
        runs=(MOTION - errors)[..., None],
        counts=np.ones((WINDOWS, SAMPLES, 1)),
        noise=np.array([noise]),
    )


def test_white_errors_stay_within_their_bands() -> None:
    white = make_runs(RNG.normal(0.0, 1e-3, (WINDOWS, SAMPLES)))
    (test,) = examine_residuals(white, white, COMMAND[:, :SAMPLES])
    assert test.channel == "cart" and test.whiteness[0] == pytest.approx(1.0)
    assert np.mean(np.abs(test.whiteness[1:]) > test.white_limit) < 0.2
    assert np.mean(np.abs(test.command) > test.command_limit) < 0.2
    assert np.median(test.after) == pytest.approx(test.noise, rel=0.1)
    assert test.frequencies_hz[0] == pytest.approx(1.0 / (SAMPLES * PERIOD_S))


def test_a_band_of_95_percent_holds_19_of_20_white_errors_at_every_lag() -> None:
    """A long lag has few pairs: nine of a hundred lay outside."""
    random, outside = np.random.default_rng(8), []
    for _ in range(40):
        white = make_runs(random.normal(0.0, 1e-3, (WINDOWS, SAMPLES)))
        (test,) = examine_residuals(white, white, COMMAND[:, :SAMPLES])
        outside.append(np.abs(test.whiteness[1:]) > test.white_limit)
    assert 0.01 < np.mean(outside) < 0.05


def test_an_error_that_follows_the_command_is_found_at_its_lag() -> None:
    late = 7
    driven = make_runs(1e-3 * COMMAND[:, 20 - late : 20 - late + SAMPLES])
    (test,) = examine_residuals(driven, driven, COMMAND[:, 20:])
    peak = int(np.argmax(test.command))
    assert test.command_lags_s[peak] == pytest.approx(late * PERIOD_S)
    assert test.command[peak] > 0.8 > 5 * test.command_limit


def test_a_slow_error_beside_a_slow_command_is_not_blamed_on_it() -> None:
    """Two slow signals are alike by chance: at three in four lags they left the band of white."""
    random, outside = np.random.default_rng(9), []
    for _ in range(10):
        errors, command = (
            np.stack([np.convolve(row, np.ones(20), "valid") for row in rows])
            for rows in random.normal(size=(2, WINDOWS, SAMPLES + 19))
        )
        runs = make_runs(1e-3 * errors)
        (test,) = examine_residuals(runs, runs, command)
        outside.append(np.abs(test.command) > test.command_limit)
    assert np.mean(outside) < 0.1


def test_a_slow_error_is_not_white() -> None:
    slow = make_runs(1e-3 * np.cumsum(RNG.normal(size=(WINDOWS, SAMPLES)), axis=1))
    (test,) = examine_residuals(slow, slow, COMMAND[:, :SAMPLES])
    assert test.whiteness[5] > 0.5 > test.white_limit
    assert test.after[0] > 10 * test.after[-1]


def test_without_a_command_or_a_finite_run_nothing_is_claimed() -> None:
    white = make_runs(RNG.normal(0.0, 1e-3, (WINDOWS, SAMPLES)))
    (test,) = examine_residuals(white, white, np.zeros((WINDOWS, SAMPLES)))
    assert test.command.size == 0
    wild = make_runs(np.full((WINDOWS, SAMPLES), np.inf))
    assert examine_residuals(white, wild, COMMAND[:, :SAMPLES]) == ()
    (test,) = examine_residuals(wild, white, COMMAND[:, :SAMPLES])
    assert np.all(np.isnan(test.before)) and np.all(np.isfinite(test.after))


def test_a_perfect_run_fits_and_a_mean_does_not() -> None:
    away = MOTION - MOTION.mean(axis=1, keepdims=True)
    fits = [float(compute_fit(make_runs(share * away))[0]) for share in (0.0, 0.1, 1.0, 2.0)]
    assert fits == pytest.approx([1.0, 0.9, 0.0, -1.0])


def test_one_run_that_diverges_decides_nothing() -> None:
    errors = np.zeros((WINDOWS, SAMPLES))
    errors[7] = np.inf
    assert compute_fit(make_runs(errors))[0] == -np.inf
    assert compute_followed_share(make_runs(errors)) > 0.8
