"""Where the cart stands at an end of the rail, its recording is left out."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import CART_NOISE_M, INTECO, PERIOD_S, POLE_NOISE_RAD

from pendulum_sysid.cleaning.rail_ends import find_rail_ends
from pendulum_sysid.fitting.windows import cut_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording
from pendulum_twin.live_twin import LiveTwin
from pendulum_twin.model import Twin
from pendulum_twin.signals import Signals

END_M = 0.9
TWIN = Twin("rail", replace(INTECO.rig, rail_half_length_m=END_M))


@pytest.fixture(scope="module")
def rolled() -> Recording:
    """Record a tilted rig that rolls to the end of its rail, and is then driven back and about."""
    live = LiveTwin(replace(TWIN, effects={"rail_tilt": {"angle_rad": 0.03}}), PERIOD_S, 0.2)
    times = np.arange(0.0, 16.0, PERIOD_S)
    command = np.where(times < 7.0, 0.0, -0.06 + 0.12 * np.sin(5.0 * times))
    states = []
    for value in command:
        states.append(live.state)
        live.commands.offer(value, 0)
        live.advance(0)
    random = np.random.default_rng(0)
    cart, pole = (
        np.array(states)[:, k] + random.normal(0.0, noise, len(times))
        for k, noise in ((0, CART_NOISE_M), (1, POLE_NOISE_RAD))
    )
    valid = np.ones(len(times), dtype=bool)
    return Recording("rolled", "sha256:0", Signals(PERIOD_S, command, cart, pole, valid, valid))


def test_a_cart_that_rolled_to_the_end_is_left_out_there(rolled: Recording) -> None:
    stood = np.abs(rolled.signals.cart - END_M) < 1e-3
    assert 100 < stood.sum() < 900, "it stands there for seconds, and not for good"
    case = prepare_case([rolled], TWIN)
    (finding,) = case.recording.findings
    assert finding.kind == "rail_end" and finding.count < 10
    assert sum(end - begin for begin, end in finding.intervals_s) > 0.01 * stood.sum()
    assert not case.signals.cart_valid[stood].any() and not case.signals.pole_valid[stood].any()
    assert case.signals.cart_valid.mean() > 0.4
    windows = cut_windows(case.signals, case.state, 0.5)
    covered = windows.begin[:, None] + np.arange(windows.samples)
    assert len(windows.begin) > 5 and not stood[covered].any()


@pytest.mark.parametrize("half_m", [None, 0.85, 1.0])
def test_an_end_that_is_elsewhere_leaves_nothing_out(
    rolled: Recording, half_m: float | None
) -> None:
    rig = replace(TWIN.rig, rail_half_length_m=half_m)
    case = prepare_case([rolled], replace(TWIN, rig=rig))
    assert "rail_end" not in {finding.kind for finding in case.recording.findings}


def test_a_cart_that_is_locked_at_the_end_leaves_the_pole_to_be_asked() -> None:
    times = np.arange(0.0, 10.0, PERIOD_S)
    random, valid = np.random.default_rng(1), np.ones(len(times), dtype=bool)
    cart = END_M + random.normal(0.0, CART_NOISE_M, len(times))
    pole = np.pi + 0.4 * np.cos(6.0 * times) + random.normal(0.0, POLE_NOISE_RAD, len(times))
    signals = Signals(PERIOD_S, np.zeros(len(times)), cart, pole, valid, valid)
    case = prepare_case([Recording("locked", "sha256:1", signals)], TWIN)
    assert case.recording.findings == () and case.signals.pole_valid.all()


def test_each_end_is_asked_for_itself() -> None:
    cart = np.array([0.0, 0.8995, 0.9, 0.5, -0.9, -0.93, 0.0])
    valid = np.ones(7, dtype=bool)
    at_end = find_rail_ends(cart, valid, END_M)
    assert at_end.tolist() == [False, True, True, False, False, False, False]
