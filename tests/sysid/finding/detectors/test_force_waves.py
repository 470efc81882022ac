"""The periods that are looked for along the rail are periods that an effect can have."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import INTECO, record_hidden

from pendulum_sysid.finding.detectors.force_waves import (
    TRIED_AT_ONCE,
    find_wave,
    fit_waves,
    list_wavenumbers,
)
from pendulum_sysid.finding.localisation.balance import FORCE, Balance, make_balance
from pendulum_sysid.prepare import prepare_case
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import make_theta


@pytest.mark.parametrize("effect", ["eccentric_pulley", "force_ripple"])
@pytest.mark.parametrize("travel", [0.005, 0.2, 1.5, 900.0])
def test_the_travel_of_a_small_cart_asks_for_no_period_beyond_the_bounds(
    effect: str, travel: float
) -> None:
    """A travel of 0.2 m divided by 66 waves is 3 mm: no twin file may hold such a period."""
    period = BY_NAME[effect].parameters[1]
    periods = 2.0 * np.pi / list_wavenumbers(travel, period)
    assert period.name == "period_m"
    assert len(periods) >= 1
    assert np.all(periods >= period.low)
    assert np.all(periods <= period.high)
    assert len(np.unique(periods)) == len(periods)


def test_a_long_travel_is_asked_from_two_to_66_waves() -> None:
    periods = 2.0 * np.pi / list_wavenumbers(1.0, BY_NAME["force_ripple"].parameters[1])
    assert periods.max() == pytest.approx(0.5)
    assert periods.min() == pytest.approx(1.0 / 65.75)
    assert len(periods) == 256


@pytest.fixture(scope="module")
def recorded() -> tuple[Balance, Floats]:
    """Return the force that the nominal twin lacks, and the cart's positions."""
    case = prepare_case([record_hidden({}, 3, 20.0)[0]], INTECO)
    balance = make_balance(case, make_theta(INTECO), FORCE)
    assert balance is not None and case.signals.cart is not None
    return balance, case.signals.cart


@pytest.mark.parametrize("count", [1, TRIED_AT_ONCE, 3 * TRIED_AT_ONCE + 1])
def test_waves_that_follow_from_one_another_are_those_of_sines(
    recorded: tuple[Balance, Floats], count: int
) -> None:
    """The first and the last wavenumber are no part of the even row, as where bounds cut it."""
    balance, values = recorded
    tried = np.concatenate([[2.9], 3.0 + 1.7 * np.arange(count), [6.0 + 1.7 * count]])
    seen: list[Floats] = []

    def make_columns(wavenumbers: Floats, sines: Floats, cosines: Floats) -> Floats:
        phase = values[:, None] * wavenumbers
        np.testing.assert_allclose(sines, np.sin(phase), atol=1e-11)
        np.testing.assert_allclose(cosines, np.cos(phase), atol=1e-11)
        seen.append(wavenumbers)
        return np.stack([sines, cosines], axis=1)

    wave = fit_waves(balance, values, make_columns, tried)
    *asked, (best,) = seen
    np.testing.assert_array_equal(np.concatenate(asked), tried)
    assert wave.wavenumber == best


def test_the_wave_is_found_that_is_there(recorded: tuple[Balance, Floats]) -> None:
    balance, values = recorded
    tried = np.arange(5.0, 80.0, 1.5)
    hidden = 0.7 * np.sin(tried[13] * values + 0.4)
    lacking = balance.sieve(hidden)
    wave = find_wave(replace(balance, lacking=lacking), np.ones_like(values), values, tried)
    assert wave.wavenumber == tried[13]
    assert wave.amplitude == pytest.approx(0.7, rel=1e-6)
    assert wave.phase == pytest.approx(0.4, abs=1e-6)
