"""A filter of the reported velocities is found by its time constant; plain differences and mere delays are none."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import hidden, reported_rates

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.finding.velocity_lag import Lag, velocity_lag


def lag_of(time_constant_s: float, seed: int = 1, late: int = 0) -> Lag | None:
    recording, _ = hidden(
        {"velocity_filter": {"time_constant_s": time_constant_s}} if time_constant_s else {},
        seed,
        20.0,
    )
    assert recording.rates is not None
    rates = np.roll(recording.rates, late, axis=0)
    return velocity_lag(replace(recording, rates=rates), smooth_state(recording.signals))


@pytest.mark.parametrize("time_constant_s", [0.012, 0.02, 0.1])
def test_the_time_constant_is_found(time_constant_s: float) -> None:
    found = lag_of(time_constant_s)
    assert found is not None
    one = found.time_constant_s
    assert one.value == pytest.approx(time_constant_s, rel=0.05)
    assert one.low < one.value < one.high


@pytest.mark.parametrize("late", [0, 1, 2])
def test_differences_and_delays_are_no_filter(late: int) -> None:
    assert lag_of(0.0, late=late) is None


def test_nothing_is_said_without_reported_velocities() -> None:
    recording, _ = hidden({}, 1, 20.0)
    assert velocity_lag(replace(recording, rates=None), smooth_state(recording.signals)) is None


def test_wild_velocities_do_not_decide() -> None:
    recording, _ = hidden({}, 2, 20.0)
    rates = reported_rates(
        np.stack([recording.signals.cart, recording.signals.pole], axis=1), 0.02
    )  # type: ignore[list-item]
    rates[::150] += 300.0
    found = velocity_lag(replace(recording, rates=rates), smooth_state(recording.signals))
    assert found is not None
    assert found.time_constant_s.value == pytest.approx(0.02, rel=0.1)
