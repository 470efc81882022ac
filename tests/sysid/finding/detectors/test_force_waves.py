"""The periods that are looked for along the rail are periods that an effect can have."""

import numpy as np
import pytest

from pendulum_sysid.finding.detectors.force_waves import list_wavenumbers
from pendulum_twin.effects import BY_NAME


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
