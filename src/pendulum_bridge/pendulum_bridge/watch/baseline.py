"""Learn what is usual for a rig beside its twin: what the twin lacks already, and the scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_bridge.watch.noise import Noise, compute_scores, weigh
from pendulum_bridge.watch.reading import Reading
from pendulum_bridge.watch.signatures import Signature, collect_worths
from pendulum_twin.arrays import Floats

LEAST_SLACK, MOST_SLACK = 0.003, 0.3  # of the activity; the least: no twin is better known
SLACKS = np.geomspace(LEAST_SLACK, MOST_SLACK, 14)
FIRST_SLACK = 4 * LEAST_SLACK
# In units of the sensor's noise: encoder steps in slow motion do not scatter evenly.
SENSOR_FACTORS = np.array([1.0, 1.5, 2.2, 3.3])
ROUNDS = 2  # of noise and sizes in turn
WINDOW_DEGREES_OF_FREEDOM = 5.0  # of a window's scatter: a single odd window must not decide


@dataclass(frozen=True)
class Baseline:
    """Hold what is usual.

    sizes: (signatures,) of what the twin lacks already, in their units.
    deviations: (signatures,) standard deviations of sizes.
    noise: the scatter around them.
    """

    sizes: Floats
    deviations: Floats
    noise: Noise


def learn_baseline(
    readings: Sequence[Reading], bank: tuple[Signature, ...], sensor: Floats
) -> Baseline:
    """Learn from windows that do not overlap.

    What the twin lacks is taken to be about as large as what is worth an alarm, until the windows
    say otherwise.

    sensor: (2,) standard deviation of a sample, m and rad.
    """
    noise = Noise(sensor, np.full(2, FIRST_SLACK))
    baseline = Baseline(np.zeros(len(bank)), collect_worths(bank), noise)
    for _ in range(ROUNDS):
        baseline = replace(baseline, noise=_learn_noise(readings, baseline, sensor))
        baseline = _learn_sizes(readings, bank, baseline)
    return baseline


def _learn_sizes(
    readings: Sequence[Reading], bank: tuple[Signature, ...], baseline: Baseline
) -> Baseline:
    """Return the baseline with the likeliest sizes for its noise; odd windows count less."""
    total, precision = np.zeros(len(bank)), np.diag(1 / collect_worths(bank) ** 2)
    zeros = np.zeros(len(bank))
    for reading in readings:
        misfit = weigh(reading, baseline.noise, baseline.sizes).misfit
        score, information = compute_scores(reading, weigh(reading, baseline.noise, zeros))
        rows = len(reading.off)
        weight = (WINDOW_DEGREES_OF_FREEDOM + rows) / (WINDOW_DEGREES_OF_FREEDOM + misfit)
        total += weight * score
        precision += weight * information
    covariance = np.linalg.inv(precision)
    return Baseline(covariance @ total, np.sqrt(np.diag(covariance)), baseline.noise)


def _learn_noise(readings: Sequence[Reading], baseline: Baseline, sensor: Floats) -> Noise:
    """Return the likeliest noise, one of its numbers after the other."""

    def compute_total(noise: Noise) -> float:
        return sum(_compute_unlikelihood(reading, noise, baseline.sizes) for reading in readings)

    noise = baseline.noise
    for joint in (0, 1):
        slacks = [_change_noise(noise, "slack", joint, slack) for slack in SLACKS]
        noise = min(slacks, key=compute_total)
    for joint in (0, 1):
        sensors = [
            _change_noise(noise, "sensor", joint, factor * sensor[joint])
            for factor in SENSOR_FACTORS
        ]
        noise = min(sensors, key=compute_total)
    return noise


def _change_noise(noise: Noise, name: str, joint: int, value: float) -> Noise:
    values = getattr(noise, name).copy()
    values[joint] = value
    return replace(noise, **{name: values})


def _compute_unlikelihood(reading: Reading, noise: Noise, sizes: Floats) -> float:
    """Return twice a window's negative log-likelihood; windows scatter as Student's t."""
    window = weigh(reading, noise, sizes)
    freedom, rows = WINDOW_DEGREES_OF_FREEDOM, len(window.off)
    if not rows:
        return 0.0
    return window.spread + (freedom + rows) * float(np.log1p(window.misfit / freedom))
