"""Bands of measured laws hold what the law is in other blocks of time."""

import functools
from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made
from support.measured_laws import measure_beside_constants

from pendulum_sysid.measuring.curve import Curve
from pendulum_sysid.measuring.law_bands import _project, _widen, widen_bands
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.naming import NamedCurve
from pendulum_sysid.measuring.shape_fit import fit_shape
from pendulum_sysid.measuring.shapes import SHAPES
from pendulum_sysid.measuring.smoothness import Smoothness
from pendulum_twin.laws import BY_NAME
from pendulum_twin.laws.law import Law, evaluate_law
from pendulum_twin.model import Twin

RIG = Twin("rig", INTECO.rig)
AT = np.linspace(-1.8, 1.8, 61)
FORCE = "cart_force_by_position"


def make_force(size: float) -> Law:
    return Law(tuple(AT), tuple(-size * AT**3))


@functools.cache
def measure_force(sizes: tuple[float, ...]) -> Measured:
    """Return the law of recordings of rigs whose forces have these sizes, N/m^3."""
    recordings = [
        made(replace(RIG, measured_laws={FORCE: make_force(size)}), 8.0, 0.25, seed)
        for seed, size in enumerate(sizes)
    ]
    measured = measure_beside_constants(recordings, RIG)
    assert measured.kinds == (FORCE,)
    return measured


def test_a_band_holds_the_law_of_every_other_recording():
    """The force of every second recording is larger; noise alone would leave a narrow band."""
    measured = measure_force((3.0, 4.0) * 3)
    (narrow,), (wide,) = measured.named[1], widen_bands(measured)
    low, high = (
        evaluate_law(BY_NAME[FORCE], make_force(size), wide.curve.knots) for size in (3.0, 4.0)
    )
    far = np.abs(high - low) > 0.5 * np.max(np.abs(high - low))
    assert far.any()
    holds = [
        np.mean([(np.abs(law.values - truth) < law.band)[far] for truth in (low, high)])
        for law in (narrow, wide)
    ]
    assert holds[0] < 0.4 and holds[1] > 0.85
    assert np.all(wide.band >= narrow.band) and np.all(wide.values == narrow.values)


def test_the_slope_of_a_line_varies_as_its_curve_does():
    """The values at the knots vary together, as a slope of deviation 0.3 would make them."""
    line = next(shape for shape in SHAPES if shape.name == "line")
    x = np.linspace(-0.5, 0.7, 13)
    fitted = fit_shape(line, x, 1.0 + 2.0 * x, np.eye(len(x)))
    deviations = _project(fitted, x, 0.3**2 * np.outer(x, x))
    slope = int(np.argmin(np.abs(fitted.values - 2.0)))
    assert deviations[slope] == pytest.approx(0.3, rel=1e-3)


def straighten_force() -> tuple[NamedCurve, Curve, Smoothness]:
    """Return the law of a force with a line for a formula, its measured curve, and the prior."""
    measured = measure_force((3.0, 4.0) * 3)
    (law,), law_fit = measured.named[1], measured.law_fit
    (curve,), (prior,) = law_fit.curves, law_fit.priors
    x = law.curve.knots
    line = next(shape for shape in SHAPES if shape.name == "line")
    shape = fit_shape(line, x, -3.0 * x, 1e4 * np.eye(len(x)))
    return replace(law, shape=shape), curve, prior


@pytest.mark.parametrize(("apart", "stays"), [(0.3, True), (3.0, False)])
def test_a_formula_that_blocks_leave_nothing_sure_of_is_told_as_a_curve(apart: float, stays: bool):
    """A slope of 1 to 5 N/m^3 between blocks is no formula for the next recording."""
    straight, curve, prior = straighten_force()
    wide = _widen(straight, curve, prior, apart**2 * np.outer(curve.knots, curve.knots))
    assert (wide.shape is not None) is stays and wide.is_doubted is not stays
    assert np.array_equal(wide.values, straight.values)


def test_over_time_a_law_keeps_the_formula_that_it_needs():
    straight, curve, prior = straighten_force()
    timed = replace(curve, kind=next(kind for kind in BY_NAME.values() if kind.timed))
    wide = _widen(straight, timed, prior, 3.0**2 * np.outer(curve.knots, curve.knots))
    assert wide.shape is not None and not wide.is_doubted


def test_at_the_noise_a_band_stays():
    measured = measure_force((3.0,) * 3)
    assert widen_bands(measured) == measured.named[1]


def test_a_recording_too_short_for_blocks_has_no_spread(monkeypatch: pytest.MonkeyPatch):
    measured = measure_force((3.0, 4.0) * 3)
    monkeypatch.setattr("pendulum_sysid.measuring.law_bands.sum_blocks", lambda *given: None)
    (narrow,), (wide,) = measured.named[1], widen_bands(measured)
    assert np.array_equal(narrow.band, wide.band)
