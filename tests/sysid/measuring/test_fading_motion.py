"""Where the motion fades all along a recording, time and amplitude look alike."""

from dataclasses import replace

import numpy as np

from pendulum_sysid.finding.localisation.balance import Motion
from pendulum_sysid.measuring.fading_motion import is_fading
from pendulum_twin.arrays import Floats

T = 0.01 * np.arange(4000)
REST = np.zeros(len(T))
DEVIATIONS = np.array([1e-4, 1e-2])  # m/s, rad/s


def swing(amplitude: Floats) -> Motion:
    """Return the motion of a pole alone whose rate has an amplitude (n,), rad/s."""
    return Motion(REST, REST, REST, amplitude * np.cos(6.0 * T), REST, REST, REST, T)


def fades(motion: Motion, command: Floats = REST) -> bool:
    return is_fading(motion, command, DEVIATIONS)


def test_a_free_decay_fades() -> None:
    assert fades(swing(5.0 * np.exp(-T / 20.0)))


def test_a_decay_that_ends_at_rest_fades() -> None:
    """Five of twelve blocks have no power at all: none of them is larger than another."""
    moves = np.arange(len(T)) < 7 * len(T) // 12
    assert fades(swing(np.where(moves, 5.0 * np.exp(-T / 20.0), 0.0)))


def test_the_noise_of_a_cart_at_rest_is_no_motion() -> None:
    noise = 1e-4 * np.random.default_rng(7).normal(size=len(T))
    assert fades(replace(swing(5.0 * np.exp(-T / 20.0)), v=noise))


def test_a_decay_whose_amplitudes_are_alike_does_not_fade() -> None:
    assert not fades(swing(5.0 * np.exp(-T / 400.0)))


def test_a_motion_that_comes_again_does_not_fade() -> None:
    assert not fades(swing(5.0 * np.exp(-np.mod(T, 20.0) / 10.0)))


def test_a_motion_that_is_driven_does_not_fade() -> None:
    """A chirp moves the cart less and less, and what changes in time is asked."""
    decay = swing(5.0 * np.exp(-T / 20.0))
    assert not fades(decay, np.sin(T**2))


def test_nothing_that_moves_does_not_fade() -> None:
    assert not fades(swing(REST))
