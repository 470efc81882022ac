"""The encoders' steps, found in positions."""

import numpy as np
import pytest

from pendulum_sysid.cleaning.encoder_steps import find_encoder_step

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
