"""Fitted parameters stay where bodies exist, and every fitted twin can be read again."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from support.made_recordings import INTECO, made

from pendulum_sysid.fitting.parameters import (
    Free,
    keep_definite,
    list_effect_parameters,
    list_rig_parameters,
    make_estimate,
    make_twin,
)
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Estimate
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parameter_vector import COUPLING, INERTIA, MASS, MOMENT, make_theta
from pendulum_twin.pole_body import check_pole_body
from pendulum_twin.rig import CART_KEYS

ALONE = replace(
    INTECO.rig,
    **dict.fromkeys((*CART_KEYS, "rail_half_length_m", "pwm_limit")),
    com_distance_m=INTECO.rig.moment_kg_m / 0.12,
)
POLE = Twin("pole", ALONE)


@pytest.mark.parametrize(
    ("value", "half", "expected"),
    [
        (2.0, 0.5, Estimate(2.0, 1.5, 2.5, True, False)),
        (0.5, 0.8, Estimate(0.5, 0.0, 1.3, True, False)),  # less than the size is fixed
        (2.0, 3.0, Estimate(2.0, 0.0, 5.0, False, False)),
        (10.0, 0.1, Estimate(10.0, 9.9, 10.0, False, True)),
        (2.0, np.inf, Estimate(2.0, 0.0, 10.0, False, False)),
        (2.0, np.nan, Estimate(2.0, 0.0, 10.0, False, False)),
    ],
)
def test_an_interval_lies_within_the_range(value: float, half: float, expected: Estimate) -> None:
    parameter = Free("level", "N", (MASS,), (1.0,), low=0.0, high=10.0, size=1.0)
    assert make_estimate(parameter, value, half) == expected


def test_a_definite_mass_matrix_is_left_alone() -> None:
    for twin in (INTECO, POLE):
        theta = make_theta(twin)
        assert keep_definite(theta) is theta


@settings(deadline=None)
@given(shares=st.lists(st.floats(0.0, 1.0), min_size=5, max_size=5))
def test_whatever_a_fit_ends_at_is_a_twin_that_can_be_read(
    tmp_path_factory: pytest.TempPathFactory, shares: list[float]
) -> None:
    """All corners of the bounds and everything between, on a scale of ratios."""
    path = tmp_path_factory.mktemp("fitted") / "twin.yaml"
    for twin in (INTECO, POLE):
        theta, free = make_theta(twin), list_rig_parameters(twin)
        for parameter, share in zip(free, shares, strict=False):
            low, high = max(parameter.low, 1e-9), parameter.high
            parameter.put(theta, float(np.clip(low * (high / low) ** share, low, high)))
        kept = keep_definite(theta)
        fitted = make_twin(twin, kept, (), free)
        check_pole_body(fitted.rig)
        save_twin(fitted, path)
        assert make_theta(load_twin(path)) == pytest.approx(kept, rel=1e-9)


def test_a_coupling_beyond_the_bodies_is_taken_back_with_its_moment() -> None:
    theta = make_theta(INTECO)
    theta[[COUPLING, MOMENT]] *= 10.0
    kept = keep_definite(theta)
    assert (
        kept[COUPLING]
        == kept[MOMENT]
        == pytest.approx(0.9999 * np.sqrt(theta[MASS] * theta[INERTIA]))
    )
    assert np.all(np.delete(kept, [COUPLING, MOMENT]) == np.delete(theta, [COUPLING, MOMENT]))


def test_a_pole_that_is_too_light_for_its_fit_takes_mass_from_the_cart(tmp_path: Path) -> None:
    theta, free = make_theta(INTECO), list_rig_parameters(INTECO)
    theta[INERTIA] *= 0.48
    fitted = make_twin(INTECO, theta, (), free)
    assert fitted.rig.pole_mass_kg == pytest.approx(0.12 / 0.917, rel=0.01)
    assert fitted.rig.total_mass_kg == pytest.approx(INTECO.rig.total_mass_kg)
    path = tmp_path / "twin.yaml"
    save_twin(fitted, path)
    assert load_twin(path) == fitted


def test_an_instant_of_joined_recordings_lies_on_the_clock_of_the_longest() -> None:
    """Bounds of 3 to 57 s held no instant of a dozen recordings of 5 s each."""
    recordings = [made(INTECO, seconds, seed=k) for k, seconds in enumerate((5.0, 8.0, 6.0))]
    case = prepare(recordings, INTECO).case
    _, time_s = list_effect_parameters(BY_NAME["load_put_on"], case.scales)
    assert (time_s.low, time_s.high) == pytest.approx((0.4, 7.6))
