"""A standstill to the last bit, out of motion and on elsewhere, is a frozen driver."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.frozen import find_frozen_runs

STAMPS = np.arange(1000) * 0.01
CART, POLE = 0.2 * np.sin(3.0 * STAMPS), np.pi + 0.4 * np.cos(5.0 * STAMPS)


def freeze(values: np.ndarray, first: int, stop: int) -> np.ndarray:
    """Repeat a sample until another one."""
    return np.where(
        (np.arange(len(values)) > first) & (STAMPS[stop] > STAMPS), values[first], values
    )


@pytest.mark.parametrize("length", [60, 150])
def test_a_frozen_driver_is_found(length: int) -> None:
    sensors = [freeze(values, 400, 400 + length) for values in (CART, POLE)]
    assert find_frozen_runs(STAMPS, sensors) == [(401, 400 + length)]


def test_a_short_standstill_is_not_judged() -> None:
    assert find_frozen_runs(STAMPS, [freeze(values, 400, 430) for values in (CART, POLE)]) == []


def test_a_joint_that_moves_on_shows_that_the_driver_lives() -> None:
    assert find_frozen_runs(STAMPS, [freeze(CART, 400, 500), POLE]) == []


def test_a_rig_that_comes_to_rest_and_starts_again_is_not_frozen() -> None:
    speed = np.clip(np.abs(STAMPS - 5.0) - 1.0, 0.0, None)
    assert find_frozen_runs(STAMPS, [np.cumsum(speed) * 0.01]) == []


@pytest.mark.parametrize("backwards", [False, True], ids=["into a stop", "away from a stop"])
def test_a_cart_that_an_end_stop_holds_is_not_frozen(backwards: bool) -> None:
    """It stops within a sample, and starts again gradually, or the other way round."""
    late_s = np.clip(STAMPS - 5.0, 0.0, None)
    cart = 0.3 * np.sin(3.0 * np.minimum(STAMPS, 4.0)) + 0.1 * (1.0 - np.cos(3.0 * late_s))
    cart = cart[::-1].copy() if backwards else cart
    assert find_frozen_runs(STAMPS, [cart]) == []
