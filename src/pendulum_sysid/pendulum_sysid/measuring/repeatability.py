"""Part what a twin does not explain into what comes again and what may be random.

Where a recording goes through a motion twice, under the same command, forces that depend on state
and command come again, whatever their laws; with them the errors of the twin come again. What
differs between the two errors may be random. It is a bound: no two motions are quite the same, and
a poor twin errs differently on motions that differ little. On the EMPS rig the difference falls
from 331 to 66 deviations of the noise once a measured law is in the twin.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from pendulum_sysid import decisions
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.window_runs import WindowRuns, run_windows
from pendulum_sysid.fitting.windows import WINDOW_S
from pendulum_sysid.records import Windows
from pendulum_twin.arrays import Floats, Ints

COMPARED_HZ = 50.0  # rate at which motions are compared
MOST_WINDOWS = 120  # that are looked for again: time
DRAWS = 1000  # of the pairs, for the interval


@dataclass(frozen=True)
class Repeatability:
    """Hold how much of a twin's squared error comes again with the same motion.

    share: of the squared error, 0 to 1; the mean over windows. At least so much comes again.
    low, high: 95 % interval of the share.
    windows: number of windows whose motion comes again, of those into which the recording is cut.
    random: the error that may be random, at most, in units of the sensors' noise; the median over
        windows.
    """

    share: float
    low: float
    high: float
    windows: int
    random: float


def measure_repeatability(case: Case) -> Repeatability | None:
    """Return how much of the twin's error comes again, over windows of `WINDOW_S`.

    None where the recording goes through too few motions twice.
    """
    first, again, samples = find_repeated_windows(case)
    if len(first) < decisions.REPEATED_LEAST_PAIRS:
        return None
    errors = [
        _list_errors(run_windows(case, Windows(begin, samples, case.state.states[begin])))
        for begin in (first, again)
    ]
    together = 0.5 * np.mean(errors[0] ** 2 + errors[1] ** 2, axis=1)
    apart = 0.5 * np.mean((errors[0] - errors[1]) ** 2, axis=1)
    whole = np.isfinite(together) & (together > 0.0)
    if whole.sum() < decisions.REPEATED_LEAST_PAIRS:
        return None
    shares = 1.0 - apart[whole] / together[whole]
    drawn = np.random.default_rng(0).integers(0, len(shares), (DRAWS, len(shares)))
    low, high = np.quantile(shares[drawn].mean(axis=1), (0.025, 0.975))
    return Repeatability(
        share=float(np.clip(shares.mean(), 0.0, 1.0)),
        low=float(np.clip(low, 0.0, 1.0)),
        high=float(np.clip(high, 0.0, 1.0)),
        windows=len(np.unique(_identify_windows(first[whole], again[whole], samples))),
        random=float(np.sqrt(np.median(apart[whole]))),
    )


def find_repeated_windows(case: Case) -> tuple[Ints, Ints, int]:
    """Return first samples of windows, of the same motions at other times, and their length.

    The first samples are (pairs,) each; two windows make one pair. The length is in samples.

    A motion is the same where state and command differ by less than `REPEATED_DISTANCE` of their
    deviations over the recording, root mean square. Windows that hardly move are left out.
    """
    signals = case.signals
    every = max(round(1.0 / (COMPARED_HZ * signals.period_s)), 1)
    shapes = _list_shapes(case)[:, ::every]
    length = round(WINDOW_S / (every * signals.period_s))
    samples = length * every + 1
    free = np.zeros(len(signals), dtype=bool)  # where a window has room in its stretch
    for stretch in signals.stretches:
        free[stretch.start : max(stretch.stop - samples, stretch.start)] = True
    begins = np.arange(0, shapes.shape[1] - length, length)
    begins = begins[free[begins * every] & _list_moving(case, begins * every, samples)]
    begins = begins[:: -(-len(begins) // MOST_WINDOWS) or 1]
    energy = np.concatenate([[0.0], np.cumsum(np.sum(shapes**2, axis=0))])
    energies = energy[length:] - energy[:-length]
    room = free[::every][: len(energies)]
    near = round(decisions.REPEATED_APART_S / (every * signals.period_s))
    size = next_fast_len(shapes.shape[1], real=True)
    spectrum = rfft(shapes, size)
    pairs: dict[tuple[int, int], tuple[int, int]] = {}
    for begin in begins:
        window = shapes[:, begin : begin + length]
        correlation = irfft((spectrum * rfft(window, size).conj()).sum(axis=0), size)
        alike = correlation[: len(energies)]  # no window beyond the end
        squares = (energies[begin] + energies - 2.0 * alike) / window.size
        squares[~room] = np.inf
        squares[max(begin - near, 0) : begin + near] = np.inf
        best = int(np.argmin(squares))
        if squares[best] < decisions.REPEATED_DISTANCE**2:
            pair = begin * every, best * every
            low, high = sorted(_identify_windows(*pair, samples).tolist())
            pairs.setdefault((low, high), pair)
    first, again = np.array(list(pairs.values()), dtype=np.int64).reshape(-1, 2).T
    return first, again, samples


def _identify_windows(first: Ints | int, again: Ints | int, samples: int) -> Ints:
    """Return which windows of the recording, counted from its start, samples are nearest to.

    first, again: first samples of windows, (pairs,) each or one of each; windows follow one
        another, the last sample of one is the first of the next.

    The numbers are (2, pairs), or (2,).
    """
    return np.round(np.array([first, again]) / (samples - 1)).astype(np.int64)


def _list_shapes(case: Case) -> Floats:
    """Return command and state, (signals, samples), each centred and in units of its deviation."""
    signals, states = case.signals, case.state.states
    rows = [signals.command]
    if signals.cart is not None:
        rows += [states[:, 0], states[:, 2]]
    if signals.pole is not None:
        rows += [np.sin(states[:, 1]), np.cos(states[:, 1]), states[:, 3]]
    shapes = np.array(rows)
    shapes -= shapes.mean(axis=1, keepdims=True)
    deviations = shapes.std(axis=1, keepdims=True)
    return np.divide(shapes, deviations, out=np.zeros_like(shapes), where=deviations > 0.0)


def _list_moving(case: Case, begin: Ints, samples: int) -> np.ndarray:
    """Return in which windows the joints are about as fast as in the recording, (windows,)."""
    rates = case.state.states[:, 2:] ** 2
    relative = rates / np.maximum(rates.mean(axis=0), 1e-300)
    energy = np.concatenate([[0.0], np.cumsum(relative.max(axis=1))])
    return (energy[begin + samples - 1] - energy[begin]) / (samples - 1) > decisions.REPEATED_RATE


def _list_errors(runs: WindowRuns) -> Floats:
    """Return measured minus run, in units of the sensors' noise, (windows, values)."""
    errors = np.where(runs.counts > 0.0, runs.measured - runs.runs, 0.0) / runs.noise
    return errors.reshape(len(runs), -1)
