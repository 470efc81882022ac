"""Forces that follow the path of the cart: what a recorded path leaves, and where a run begins."""

from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import THESIS, X, recording, run, wild_command

from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.path_forces import follow_recorded_path

COMMAND = wild_command(300)
FRICTION = {"cart_presliding_friction": {"level_n": 0.8, "distance_m": 0.05}}
THETA = make_theta(Twin("test", THESIS, FRICTION))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_window_begins_with_the_force_that_its_past_leaves(sign):
    wiring = {"cart_sign_inverted": {}} if sign < 0.0 else {}
    whole = run(THESIS, COMMAND, FRICTION | wiring)
    signals = replace(recording(COMMAND, 0.01), cart=whole[:, X])
    begin = np.array([60, 150, 233])
    theta = make_theta(Twin("test", THESIS, FRICTION | wiring))[None]
    windows = run_freely(signals, theta, np.zeros(3, dtype=np.int64), begin, whole[begin], 50)
    for window, k in zip(windows, begin, strict=True):
        np.testing.assert_allclose(window, whole[k : k + 50], atol=2e-3)


def test_a_path_is_forgotten_where_a_new_stretch_begins():
    x = np.concatenate([np.linspace(0.0, 0.2, 50), np.full(50, 0.9)])
    signals = recording(np.zeros(100), 0.01).break_at([50])
    forces = follow_recorded_path(signals, x, THETA)[:, 0]
    assert forces[49] == pytest.approx(-0.8 * (1.0 - np.exp(-4.0)))
    assert not np.any(forces[50:])


def test_a_path_that_goes_on_is_slipping_and_one_that_turns_round_springs_back():
    x = np.concatenate([np.linspace(0.0, 1.0, 50), np.linspace(1.0, 0.965, 50)])
    forces = follow_recorded_path(recording(np.zeros(100), 0.01), x, THETA)[:, 0]
    assert forces[49] == pytest.approx(-0.8)
    assert forces[99] == pytest.approx(0.8 * (1.0 - 2.0 * np.exp(-0.7)))
