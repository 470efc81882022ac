"""Test the errors of held-out runs: are they white, and does the command explain them?

The tests are those of Ljung, System Identification, 2nd edition, section 16.6. Free runs start
anew in every window, so lags stay within a window. Every window counts alike, whatever the size of
its errors: one run near upright decides nothing.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.fitting.window_runs import JOINTS, UNITS, WindowRuns
from pendulum_sysid.verdict.drawn import ResidualTest
from pendulum_twin.arrays import Floats, Ints, Mask

LAGS_SHARE = 0.5  # of a window; longer lags have too few pairs
MOST_LAGS = 60  # lags that are drawn
MOST_LINES = 160  # frequencies that are drawn


def examine_residuals(
    before: WindowRuns, after: WindowRuns, command: Floats
) -> tuple[ResidualTest, ...]:
    """Return the tests of each channel whose runs stay finite; none without windows.

    command: (windows, samples) what was asked of the drive in these windows.
    """
    return tuple(
        _examine_channel(before, after, command, k, joint)
        for k, joint in enumerate(after.channels)
        if np.any(_find_finite(after, k))
    )


def _examine_channel(
    before: WindowRuns, after: WindowRuns, command: Floats, k: int, joint: int
) -> ResidualTest:
    finite = _find_finite(after, k)
    valid = after.counts[finite, :, k] > 0.0
    errors = np.where(valid, (after.measured - after.runs)[finite, :, k], 0.0)
    driven = command[finite] - command[finite].mean()
    scaled = errors / np.maximum(np.sqrt(np.mean(errors**2, axis=1, keepdims=True)), 1e-300)
    samples = after.measured.shape[1]
    lags = _choose_lags(max(int(samples * LAGS_SHARE), 1))
    count = float(valid.sum())
    own = correlate(scaled, scaled, lags)
    limit = decisions.INTERVAL_DEVIATIONS / np.sqrt(count)
    both = np.concatenate([-lags[:0:-1], lags])
    moves = bool(np.any(driven))
    own_command = correlate(driven, driven, lags) if moves else np.zeros(0)
    step = float(lags[1] - lags[0]) if len(lags) > 1 else 1.0
    grown = 1.0 + 2.0 * step * float(own[1:] @ own_command[1:]) if moves else 1.0
    return ResidualTest(
        channel=JOINTS[joint],
        unit=UNITS[joint],
        lags_s=np.asarray(lags * after.period_s, dtype=np.float64),
        whiteness=own,
        white_limit=float(limit),
        command_lags_s=np.asarray(both * after.period_s, dtype=np.float64),
        command=correlate(scaled, driven, both) if moves else np.empty(0),
        command_limit=float(limit * np.sqrt(max(grown, 1.0))),
        frequencies_hz=_list_frequencies(samples, after.period_s),
        before=compute_spectrum(before, k),
        after=compute_spectrum(after, k),
        noise=float(after.noise[k] * np.sqrt(2.0 * after.period_s)),
    )


def correlate(first: Floats, second: Floats, lags: Ints) -> Floats:
    """Return the correlation of first(t) with second(t - lag), (lags,).

    The sum over the pairs of a lag is divided by the number of all samples, so that white errors
    lie within one band at every lag, however few pairs a long lag has.

    first, second: (windows, samples); pairs stay within a window.
    lags: samples, of either sign.
    """
    samples = first.shape[1]
    power = np.sqrt(np.mean(first**2) * np.mean(second**2))
    sums = []
    for lag in lags.tolist():
        late, early = max(lag, 0), max(-lag, 0)
        length = samples - late - early
        pairs = first[:, late : late + length] * second[:, early : early + length]
        sums.append(np.sum(pairs) / max(power * first.size, 1e-300))
    return np.array(sums)


def compute_spectrum(runs: WindowRuns, k: int) -> Floats:
    """Return the amplitude spectral density of a channel's errors, per sqrt(Hz), over windows.

    It is the median over the windows, set to the mean of white noise; NaN where no run is finite.
    """
    finite = _find_finite(runs, k)
    lines = _choose_lines(runs.measured.shape[1])
    if not np.any(finite):
        return np.full(len(lines), np.nan)
    errors = (runs.measured - runs.runs)[finite, :, k] * runs.counts[finite, :, k]
    shape = np.hanning(errors.shape[1] + 2)[1:-1]
    with np.errstate(over="ignore"):
        power = np.abs(np.fft.rfft(errors * shape, axis=1)) ** 2 * 2.0 * runs.period_s
    median = np.median(power[:, lines], axis=0) / (np.log(2.0) * np.sum(shape**2))
    return np.asarray(np.sqrt(median))


def _find_finite(runs: WindowRuns, k: int) -> Mask:
    return np.asarray(np.all(np.isfinite(runs.runs[..., k]), axis=1))


def _choose_lags(most: int) -> Ints:
    step = -(-most // MOST_LAGS)
    return np.arange(0, most + 1, step)


def _choose_lines(samples: int) -> Ints:
    lines = np.arange(1, samples // 2 + 1)
    if len(lines) <= MOST_LINES:
        return lines
    return np.unique(np.round(np.geomspace(1, lines[-1], MOST_LINES)).astype(int))


def _list_frequencies(samples: int, period_s: float) -> Floats:
    return np.asarray(np.fft.rfftfreq(samples, period_s)[_choose_lines(samples)])
