"""The encoders' steps, found in positions."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.encoder_steps import find_encoder_step, find_shaft_turn
from pendulum_twin.signals import Signals

TIME = np.arange(3000) * 0.01
SWING = 0.3 * np.sin(1.7 * TIME) + 0.05 * np.sin(5.1 * TIME + 1)


@pytest.mark.parametrize("step", [57e-6, 2 * np.pi / 4096, 2 * np.pi / 1024])
@pytest.mark.parametrize("zero", [0.0, 0.7123])
def test_the_step_is_found(step: float, zero: float) -> None:
    assert find_encoder_step(zero + np.rint(SWING / step) * step) == pytest.approx(step, rel=1e-3)


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_positions_without_steps_have_none(noise: float) -> None:
    assert (
        find_encoder_step(SWING + noise * np.random.default_rng(1).standard_normal(len(SWING)))
        == 0.0
    )


def test_what_never_moves_and_what_is_missing_tells_nothing() -> None:
    assert (
        find_encoder_step(np.zeros(100)) == 0.0
        and find_encoder_step(None) == 0.0
        and find_encoder_step(SWING[:5]) == 0.0
    )


def test_a_few_spikes_do_not_hide_it() -> None:
    positions = np.rint(SWING / 1e-3) * 1e-3
    positions[[100, 900, 2000]] += 0.12345
    assert find_encoder_step(positions) == pytest.approx(1e-3, rel=1e-3)


@pytest.mark.parametrize(
    ("step_m", "step_rad", "turn_m"),
    [
        (57e-6, 2 * np.pi / 4096, 57e-6 * 4096),
        (57e-6, 2 * np.pi / 1024, 57e-6 * 1024),
        (57e-6, 1e-3, 0.0),  # no whole number of counts a turn
        (57e-6, 0.0, 0.0),
        (0.0, 2 * np.pi / 4096, 0.0),
    ],
)
def test_the_cart_s_encoder_has_the_counts_of_the_pole_s(
    step_m: float, step_rad: float, turn_m: float
) -> None:
    cart, pole = (
        np.rint(SWING / step) * step if step else SWING + 1e-7 * np.cos(TIME * k)
        for k, step in enumerate((step_m, step_rad), start=3)
    )
    seen = np.ones(len(SWING), dtype=bool)
    signals = Signals(0.01, np.zeros(len(SWING)), cart, pole, seen, seen)
    assert find_shaft_turn(signals) == pytest.approx(turn_m, rel=1e-3)


def test_a_cart_alone_tells_no_turn() -> None:
    seen = np.ones(len(SWING), dtype=bool)
    cart = np.rint(SWING / 57e-6) * 57e-6
    assert find_shaft_turn(Signals(0.01, np.zeros(len(SWING)), cart, None, seen, seen)) == 0.0
