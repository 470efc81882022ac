"""What is usual for a rig beside its twin, learned while it moves: sizes that the twin lacks already, and the scatter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_bridge.watch.noise import Noise, scores, weighed
from pendulum_bridge.watch.reading import Reading
from pendulum_bridge.watch.signatures import Signature, worth_of
from pendulum_twin.arrays import Floats

LEAST_SLACK, MOST_SLACK = 0.003, 0.3  # of the activity; the least: no twin is better known
SLACKS = np.geomspace(LEAST_SLACK, MOST_SLACK, 14)
COARSER = np.array(
    [1.0, 1.5, 2.2, 3.3]
)  # times the sensor's noise: encoder steps in slow motion do not scatter evenly
ROUNDS = 2
HEAVY = 5.0  # degrees of freedom of the scatter from window to window: a single odd one must not decide


@dataclass(frozen=True)
class Baseline:
    """Hold what is usual: sizes (signatures,) in their units, their deviations, and the noise about them."""

    sizes: Floats
    deviations: Floats
    noise: Noise


def learned(readings: Sequence[Reading], bank: tuple[Signature, ...], sensor: Floats) -> Baseline:
    """Learn from windows that do not overlap.

    What the twin lacks is believed to be about as large as what is worth an alarm, until the
    windows say otherwise.
    sensor: (2,) deviation of a sample, m and rad.
    """
    baseline = Baseline(
        np.zeros(len(bank)), worth_of(bank), Noise(sensor, np.full(2, 4 * LEAST_SLACK))
    )
    for _ in range(ROUNDS):
        baseline = replace(baseline, noise=_scatter(readings, baseline, sensor))
        baseline = _sizes(readings, bank, baseline)
    return baseline


def _sizes(
    readings: Sequence[Reading], bank: tuple[Signature, ...], baseline: Baseline
) -> Baseline:
    """Return the baseline with the most likely sizes for its noise; windows that are far off count less."""
    total, precision = np.zeros(len(bank)), np.diag(1 / worth_of(bank) ** 2)
    none = np.zeros(len(bank))
    for reading in readings:
        misfit = weighed(reading, baseline.noise, baseline.sizes).misfit
        score, information = scores(reading, weighed(reading, baseline.noise, none))
        weight = (HEAVY + len(reading.off)) / (HEAVY + misfit)
        total += weight * score
        precision += weight * information
    covariance = np.linalg.inv(precision)
    return Baseline(covariance @ total, np.sqrt(np.diag(covariance)), baseline.noise)


def _scatter(readings: Sequence[Reading], baseline: Baseline, sensor: Floats) -> Noise:
    """Return the most likely noise, one of its numbers after the other."""
    noise = baseline.noise

    def unlikely(tried: Noise) -> float:
        return sum(_unlikely(reading, tried, baseline.sizes) for reading in readings)

    for joint in (0, 1):
        slacks = [_with(noise, "slack", joint, slack) for slack in SLACKS]
        noise = min(slacks, key=unlikely)
    for joint in (0, 1):
        coarse = [_with(noise, "sensor", joint, factor * sensor[joint]) for factor in COARSER]
        noise = min(coarse, key=unlikely)
    return noise


def _with(noise: Noise, name: str, joint: int, value: float) -> Noise:
    values = getattr(noise, name).copy()
    values[joint] = value
    return replace(noise, **{name: values})


def _unlikely(reading: Reading, noise: Noise, sizes: Floats) -> float:
    window = weighed(reading, noise, sizes)
    rows = len(window.off)
    return window.spread + (HEAVY + rows) * float(np.log1p(window.misfit / HEAVY)) if rows else 0.0
