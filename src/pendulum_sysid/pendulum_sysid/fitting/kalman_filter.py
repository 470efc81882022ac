"""Predict the deviations from a smoothed motion, sample by sample, while latent forces wander.

An extended Kalman filter along the smoothed motion (Anderson and Moore, Optimal Filtering (1979),
section 8.2): deviations of the state pass through the twin's own derivatives, two forces decay and
are driven anew (Hartikainen and Sarkka, IEEE MLSP (2010)), and what a sensor shows corrects both.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pendulum_twin.machine_code import make_cached_compiler

STATES = 4  # x, th, v, w; behind them stand the force on the cart and the torque on the pole
SIZE = STATES + 2


@make_cached_compiler(Path(__file__))
def filter_motion(  # type: ignore[no-untyped-def]
    first,
    predicted,
    gaps,
    transitions,
    pushes,
    measured,
    counts,
    channels,
    start,
    decay,
    inflow,
    noise,
    white,
    log_deviations,
):
    """Fill in the whitened errors of prediction, and the logarithms of their deviations.

    Entry k of the arrays belongs to the way into sample k.

    first: (samples,) whether a run begins there, with the smoothed state.
    predicted: (samples,) whether the sample's positions are predicted, and correct the filter.
    gaps: (columns, samples, 4) what a run of one sample, begun on the smoothed motion, misses of
        the next smoothed state. The first column predicts; the others are derivatives of its
        errors, and are filtered with its gains.
    transitions: (samples, 4, 4) how deviations pass over a sample.
    pushes: (samples, 4, 2) what a unit of force and of torque add over a sample.
    measured: (samples, channels) measured minus smoothed position, m and rad.
    counts: (samples, channels) 1 where a measured position is valid, else 0.
    channels: (channels,) the entry of a state that each channel shows.
    start: (6,) variances where a run begins.
    decay: share of the forces that is left after a sample.
    inflow: (2,) variance that drives the forces anew over a sample.
    noise: (channels,) variance of each channel's noise.
    white: (columns, predictions, channels) is filled; 0 where nothing is valid.
    log_deviations: (predictions,) is filled with their sum over the channels.
    """
    mean = np.zeros((gaps.shape[0], SIZE))
    spread = np.zeros((SIZE, SIZE))
    matrix, passed = np.zeros((SIZE, SIZE)), np.zeros((SIZE, SIZE))
    matrix[4, 4], matrix[5, 5] = decay, decay
    row = -1
    for k in range(gaps.shape[1]):
        if first[k]:
            mean[:] = 0.0
            spread[:] = 0.0
            for i in range(SIZE):
                spread[i, i] = start[i]
        else:
            matrix[:STATES, :STATES] = transitions[k]
            matrix[:STATES, STATES:] = pushes[k]
            _predict_mean(mean, matrix, gaps[:, k])
            _predict_spread(spread, matrix, inflow, passed)
        if predicted[k]:
            row += 1
            log_deviations[row] = _correct(
                mean, spread, measured[k], counts[k], channels, noise, white[:, row]
            )


@make_cached_compiler(Path(__file__))
def _predict_mean(mean, matrix, gaps):  # type: ignore[no-untyped-def]
    """Pass the mean of each column over a sample, and add what the column's run misses."""
    moved = np.zeros(SIZE)
    for c in range(len(mean)):
        for i in range(SIZE):
            moved[i] = gaps[c, i] if i < STATES else 0.0
            for j in range(SIZE):
                moved[i] += matrix[i, j] * mean[c, j]
        mean[c] = moved


@make_cached_compiler(Path(__file__))
def _predict_spread(spread, matrix, inflow, passed):  # type: ignore[no-untyped-def]
    """Pass the covariance over a sample, and drive the forces anew; passed is scratch space."""
    for i in range(SIZE):
        for j in range(SIZE):
            passed[i, j] = 0.0
            for m in range(SIZE):
                passed[i, j] += matrix[i, m] * spread[m, j]
    for i in range(SIZE):
        for j in range(i + 1):
            total = 0.0
            for m in range(SIZE):
                total += passed[i, m] * matrix[j, m]
            spread[i, j], spread[j, i] = total, total
    spread[4, 4] += inflow[0]
    spread[5, 5] += inflow[1]


@make_cached_compiler(Path(__file__))
def _correct(  # type: ignore[no-untyped-def]
    mean, spread, measured, counts, channels, noise, white
):
    """Correct mean and covariance by each channel's reading; fill in the whitened errors.

    Return the sum of the logarithms of the deviations.
    """
    logarithms = 0.0
    for c in range(len(channels)):
        if counts[c] == 0.0:
            continue
        at = channels[c]
        variance = spread[at, at] + noise[c]
        deviation = np.sqrt(variance)
        logarithms += np.log(deviation)
        gain = spread[at].copy() / variance
        for column in range(len(mean)):
            shown = measured[c] if column == 0 else 0.0
            error = shown - mean[column, at]
            white[column, c] = error / deviation
            mean[column] += gain * error
        for i in range(SIZE):
            for j in range(SIZE):
                spread[i, j] -= gain[i] * gain[j] * variance
    return logarithms
