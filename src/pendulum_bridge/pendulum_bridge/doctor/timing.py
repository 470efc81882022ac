"""The checks of rate, jitter and losses. Times are arrivals at this machine, s.

Samples carry no number and no time. A lost sample moves all later samples by a period; a late
sample moves only itself. So the least lateness of all later samples counts the losses.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_twin.arrays import Floats

SPAN_SAMPLES = 10  # over which the period is measured, so that a coarse timer evens out
# Relative errors of the rate: up to the first it is right, beyond the second nothing works.
CLOSE_RATE_SHARE, FAR_RATE_SHARE = 0.02, 0.1
FEW_LOST_SHARE, MANY_LOST_SHARE = 0.005, 0.1  # of all samples
BURST_PERIODS = 0.2  # closer samples came in a burst
BURST_SHARE = 0.1
# By so many periods may a sample after a loss be less late than the earliest sample before it.
EARLY_PERIODS = 0.3
LARGEST_JITTER_PERIODS = 0.5  # of the 99th percentile
FEWEST_SAMPLES = 2 * SPAN_SAMPLES


def measure_period(arrivals: Floats, expected_s: float) -> float:
    """Return the sample period (s), robust against a few losses and jitter.

    When most samples keep the expected period, a longer mean period means losses. When samples
    come in bursts, a line through all arrivals gives the period.
    arrivals: (n,) s, at least 2.
    """
    intervals = np.diff(arrivals)
    single = float(np.median(intervals))
    if len(arrivals) < FEWEST_SAMPLES or _compute_burst_share(intervals, expected_s) > BURST_SHARE:
        return float(np.polyfit(np.arange(len(arrivals)), arrivals - arrivals[0], 1)[0])
    spans = float(np.median(arrivals[SPAN_SAMPLES:] - arrivals[:-SPAN_SAMPLES])) / SPAN_SAMPLES
    keeps = abs(single / expected_s - 1) < 2 * CLOSE_RATE_SHARE
    return single if keeps and spans > (1 + 2 * CLOSE_RATE_SHARE) * expected_s else spans


def number_samples(arrivals: Floats, period_s: float) -> NDArray[np.int64]:
    """Return the number of each sample (n,) from 0, lost samples counted.

    Losses among the last SPAN_SAMPLES are not counted.
    """
    count = np.arange(len(arrivals))
    late = arrivals - count * period_s
    after = np.minimum.accumulate(late[::-1])[::-1]
    after[-SPAN_SAMPLES:] = after[-SPAN_SAMPLES:][0]  # too few follow to tell lost from late
    return count + np.floor((after - after[0]) / period_s + EARLY_PERIODS).astype(np.int64)


def check_rate(arrivals: Floats, expected_hz: float) -> Finding:
    """Return whether samples come at the expected rate."""
    expected = f"{expected_hz:g} Hz"
    if len(arrivals) < FEWEST_SAMPLES:
        return Finding(Check.RATE, expected, f"{len(arrivals)} samples in all", Fault.RATE_WRONG)
    found_hz = 1 / measure_period(arrivals, 1 / expected_hz)
    off = abs(found_hz / expected_hz - 1)
    fault = (
        None
        if off <= CLOSE_RATE_SHARE
        else Fault.RATE_OFF
        if off <= FAR_RATE_SHARE
        else Fault.RATE_WRONG
    )
    return Finding(Check.RATE, expected, f"{found_hz:.1f} Hz", fault)


def check_jitter(arrivals: Floats, period_s: float) -> Finding:
    """Return whether samples come evenly: errors of the intervals, and share of bursts."""
    intervals = np.diff(arrivals)
    off_ms = 1e3 * np.abs(intervals - period_s)
    at_once = _compute_burst_share(intervals, period_s)
    p50, p99, most = np.percentile(off_ms, [50, 99, 100])
    observed = f"{p50:.2f} ms (p50), {p99:.2f} ms (p99), {most:.1f} ms (most)"
    expected = f"intervals off by under {1e3 * LARGEST_JITTER_PERIODS * period_s:.1f} ms (p99)"
    if at_once > BURST_SHARE:
        return Finding(
            Check.JITTER,
            expected,
            f"{observed}; {at_once:.0%} of the samples together with another",
            Fault.BURSTS,
        )
    return Finding(
        Check.JITTER,
        expected,
        observed,
        Fault.JITTER if p99 > 1e3 * LARGEST_JITTER_PERIODS * period_s else None,
    )


def check_losses(arrivals: Floats, period_s: float) -> Finding:
    """Return whether samples are missing."""
    lost = int(number_samples(arrivals, period_s)[-1]) + 1 - len(arrivals)
    share = lost / (lost + len(arrivals))
    fault = (
        None
        if share <= FEW_LOST_SHARE
        else Fault.SOME_LOST
        if share <= MANY_LOST_SHARE
        else Fault.MANY_LOST
    )
    return Finding(Check.LOSSES, "no sample lost", f"{lost} of {lost + len(arrivals)} lost", fault)


def _compute_burst_share(intervals: Floats, period_s: float) -> float:
    return float(np.mean(intervals < BURST_PERIODS * period_s))
