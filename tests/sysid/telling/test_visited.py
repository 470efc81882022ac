"""What a recording visited stands in its verdict, and its report says that no more is known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.case import make_case
from pendulum_sysid.records import Recording
from pendulum_sysid.telling.visited import describe_visited, measure_visited
from pendulum_twin.signals import Signals

PERIOD_S = 0.01


def record(cart: np.ndarray | None, pole: np.ndarray | None) -> Recording:
    """Return a recording of these positions (m) and angles (rad), without noise."""
    count = len(cart if cart is not None else pole if pole is not None else ())
    every, command = np.ones(count, dtype=bool), 0.3 * np.sin(0.02 * np.arange(count))
    return Recording("made", "sha256:0", Signals(PERIOD_S, command, cart, pole, every, every))


def measure(recording: Recording) -> dict[str, tuple[float, float]]:
    return measure_visited(make_case(recording, smooth_state(recording.signals), INTECO))


def test_the_range_of_each_variable_is_measured() -> None:
    times = PERIOD_S * np.arange(2000)
    cart, pole = 0.1 + 0.3 * np.sin(2.0 * times), math.pi + 0.8 * np.sin(3.0 * times)
    visited = measure(record(cart, pole))
    ranges = {
        "cart_position": (-0.2, 0.4),
        "cart_velocity": (-0.6, 0.6),
        "pole_angle": (-0.8, 0.8),
        "pole_rate": (-2.4, 2.4),
        "command": (-0.3, 0.3),
    }
    assert {name: pytest.approx(ends, abs=0.02) for name, ends in ranges.items()} == visited


def test_a_joint_that_was_not_recorded_visits_nothing() -> None:
    swing = math.pi + 0.5 * np.cos(0.05 * np.arange(1000))
    assert set(measure(record(None, swing))) == {"pole_angle", "pole_rate"}


def test_samples_that_were_left_out_are_not_visited() -> None:
    recording = record(0.001 * np.arange(1000), np.full(1000, math.pi))
    usable = replace(recording.signals, cart_valid=np.arange(1000) < 500)
    low, high = measure(replace(recording, signals=usable))["cart_position"]
    assert (low, high) == pytest.approx((0.0, 0.499), abs=0.01)


@pytest.mark.parametrize(
    ("angles", "said"),
    [
        ((-0.8, 1.81), "the pole goes up to 1.81 rad from hanging, at up to 2.40 rad/s"),
        ((-3.1, 3.13), "the pole goes through all angles, at up to 2.40 rad/s"),
    ],
)
def test_the_sentence_says_where_no_twin_was_compared(
    angles: tuple[float, float], said: str
) -> None:
    visited = {"pole_angle": angles, "pole_rate": (-2.4, 1.0)}
    assert describe_visited(visited) == (
        f"In this recording {said}. Beyond, no twin was compared with the rig."
    )
    both = {"cart_position": (-0.2, 0.4), "cart_velocity": (-0.6, 0.5), **visited}
    sentence = describe_visited(both)
    assert "the cart goes from −0.200 to 0.400 m, at up to 0.600 m/s, and the pole" in sentence
    assert describe_visited({}) == ""
