"""A curve with a band gets the name of the shape that made it, with its sizes."""

import numpy as np
import pytest

from pendulum_sysid.measuring.shape_fit import rank_shapes
from pendulum_sysid.measuring.shapes import GAIN_TIME_SHAPES, SETTLING_WAVE, SHAPES, TURN_SHAPES

X = np.linspace(-0.4, 0.4, 20)
CLOCK = np.linspace(0.0, 60.0, 61)
TURN = np.arange(20) * 2 * np.pi / 20
CASES = {
    "cube": (X, -20.0 * X**3, {"factor": -20.0}),
    "line": (X, 0.3 + 2.0 * X, {"slope": 2.0, "offset": 0.3}),
    "signed square": (X, 3.0 * X * np.abs(X), {"factor": 3.0}),
    "size": (X, 1.0 - 1.5 * np.abs(X), {"factor": -1.5}),
    "bump": (X, 0.2 + np.exp(-(((X - 0.1) / 0.12) ** 2)), {"centre": 0.1, "width": 0.12}),
    "wave": (X, 0.5 * np.sin(2 * np.pi * X / 0.23), {"period": 0.23, "sine": 0.5}),
    "wave, many": (CLOCK, 0.3 * np.sin(0.27 * 2 * np.pi * CLOCK + 1.0), {"period": 1 / 0.27}),
    "saturation": (X, 0.7 * np.tanh(X / 0.1), {"width": 0.1, "factor": 0.7}),
    "bend": (
        X,
        0.05 + 0.1 * np.minimum(X - 0.1, 0.0) - 0.3 * np.maximum(X - 0.1, 0.0),
        {"before": 0.1, "behind": -0.3, "offset": 0.05, "place": 0.1},
    ),
    "exponential": (X + 0.4, 1.0 - np.exp(-(X + 0.4) / 0.2), {"length": 0.2, "factor": -1.0}),
    "exponential and wave": (
        CLOCK,
        0.03 * np.exp(-CLOCK / 11.0) + 0.02 * np.cos(2 * np.pi * CLOCK / 5.3),
        {"factor": 0.03, "cosine": 0.02, "length": 11.0, "period": 5.3},
    ),
    "wave of a turn, 3 times": (TURN, 0.01 * np.sin(3 * TURN + 1.0), {"sine": 0.01 * np.cos(1.0)}),
}


@pytest.mark.parametrize("name", CASES)
def test_a_shape_is_told_from_the_others(name):
    x, y, sizes = CASES[name]
    deviation = 0.01 * np.ptp(y)
    noisy = y + deviation * np.random.default_rng(1).normal(size=len(x))
    shapes = TURN_SHAPES if x is TURN else GAIN_TIME_SHAPES if x is CLOCK else SHAPES
    best = rank_shapes(shapes, x, noisy, deviation**2 * np.eye(len(x)))[0]
    assert best.shape.name == name.removesuffix(", many")
    found = dict(zip(best.names, zip(best.values, best.deviations, strict=True), strict=True))
    for key, size in sizes.items():
        value, doubt = found[key]
        assert abs(value - size) < 4 * doubt + 1e-9, (key, value, doubt)
        assert doubt < 0.2 * abs(size)


@pytest.mark.parametrize(
    "shape", (*SHAPES, SETTLING_WAVE, *TURN_SHAPES), ids=lambda shape: shape.name
)
def test_a_shape_is_finite_whatever_its_parameters(shape):
    x = np.linspace(-0.4, 0.4, 21)  # 0 is among the places, and 0 / 0 no number
    for more in (0.0, 1e-300, -1.0, 1e300):
        assert np.isfinite(shape.draw_columns(x, [more] * len(shape.more))).all()


def test_a_sharp_edge_is_fitted_by_finite_numbers():
    x = np.linspace(-0.4, 0.4, 21)
    for fitted in rank_shapes(SHAPES, x, np.sign(x), 1e-6 * np.eye(21)):
        assert np.isfinite([*fitted.values, *fitted.curve, fitted.misfit]).all(), fitted.shape.name


def test_a_straight_line_seldom_has_a_bend():
    x = np.linspace(-0.4, 0.4, 21)
    best = [
        rank_shapes(SHAPES, x, 0.2 * x + noise, 1e-6 * np.eye(21))[0].shape.name
        for noise in 0.001 * np.random.default_rng(2).normal(size=(20, 21))
    ]
    assert best.count("bend") <= 2, best


def test_a_bump_whose_top_was_not_seen_is_no_bump():
    """Friction that rises along the rail was told as a bump 4.1 m away, on a rail of 1.6 m."""
    x = np.linspace(-0.92, 0.71, 20)
    rising = np.maximum(2.0 + 4.0 * x, 0.0)
    for fitted in rank_shapes(SHAPES, x, rising, 1e-3 * np.eye(20)):
        sizes = dict(zip(fitted.names, fitted.values, strict=True))
        assert -0.92 <= sizes.get("centre", 0.0) <= 0.71, fitted.shape.name


def test_half_a_wave_is_no_wave():
    """A hump that was seen in part may be anything, and says nothing of the next recording."""
    hump = np.sin(np.pi * CLOCK / 75.0)
    shapes = rank_shapes(GAIN_TIME_SHAPES, CLOCK, hump, 1e-4 * np.eye(len(CLOCK)))
    waves = [fitted for fitted in shapes if "period" in fitted.names]
    assert len(waves) == 2
    for wave in waves:
        assert wave.misfit > 100.0 or not wave.values[-1] > 60.0
