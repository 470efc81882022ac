"""A sample that is missing is no measurement: neither an error nor a picture counts it."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Recording
from pendulum_sysid.telling.drawings import draw_overlays
from pendulum_sysid.telling.report_data import encode_runs
from pendulum_sysid.telling.window_figures import compute_window_errors, draw_windows
from pendulum_sysid.telling.window_list import HELD_OUT, WindowRow, compute_errors, find_worst

LOST = slice(1130, 1170)  # samples, in a held-out window


@pytest.fixture(scope="module")
def runs() -> WindowRuns:
    """Return held-out runs on a recording without 0.4 s of the pole's angle."""
    signals = made(INTECO, 40.0).signals
    assert signals.cart is not None and signals.pole is not None
    pole = signals.pole.copy()
    pole[LOST] = np.nan
    recording = Recording.from_arrays(signals.times_s, signals.command, signals.cart, pole)
    prepared = prepare([recording], INTECO)
    runs = run_windows(prepared.case, prepared.split.held_out)
    assert np.sum(runs.counts == 0.0) == len(range(LOST.start, LOST.stop))
    return runs


def test_errors_of_windows_are_those_of_the_samples_that_are_there(runs: WindowRuns) -> None:
    """A pole that was off by 3.5 mrad was said to be off by 264 mrad."""
    overlays = draw_overlays(runs, runs)
    errors = compute_errors(overlays, "after")
    np.testing.assert_allclose(errors, runs.window_rmse, rtol=1e-9)
    for k, overlay in enumerate(overlays):
        _, before, after = compute_window_errors(overlay)
        np.testing.assert_allclose(after, runs.window_rmse[:, k], rtol=1e-9)
        np.testing.assert_array_equal(before, after)


def test_the_worst_window_is_not_that_with_missing_samples(runs: WindowRuns) -> None:
    errors = compute_errors(draw_overlays(runs, runs), "after")
    rows = [
        WindowRow(0, HELD_OUT, begin, begin + 1.0, tuple(row), tuple(row), k)
        for k, (begin, row) in enumerate(zip(runs.begin_s.tolist(), errors, strict=True))
    ]
    usual = runs.window_rmse / np.median(runs.window_rmse, axis=0)
    worst = find_worst(rows)
    assert worst is not None and worst.index == int(np.argmax(usual.max(axis=1)))


def test_a_run_that_diverged_has_no_finite_error(runs: WindowRuns) -> None:
    wild = replace(runs, runs=np.full_like(runs.runs, np.nan))
    assert not np.any(np.isfinite(compute_errors(draw_overlays(runs, wild), "after")))


def test_pictures_leave_missing_samples_out(runs: WindowRuns) -> None:
    far = replace(runs, runs=runs.runs + 1e3)
    overlay = draw_overlays(far, runs)[runs.channels.index(1)]
    lost = int(np.argmax(np.isnan(overlay.measured).any(axis=1)))
    span = np.nanmax(overlay.measured[lost]) - np.nanmin(overlay.measured[lost])
    assert encode_runs(overlay, lost)["step"] * 32_000 == pytest.approx(3.5 * span, rel=0.05)
    pictures = "".join(draw_windows(overlay))
    assert "infinitely far" not in pictures and "nan" not in pictures
