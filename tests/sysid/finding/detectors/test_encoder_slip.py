"""A slip of the encoder is seen where it happened, and fast motion is none."""

from dataclasses import replace

import numpy as np
import pytest
from support.hidden_physics import record_hidden

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.finding.detectors.encoder_slip import AngleStep, find_angle_steps
from pendulum_sysid.records import Recording
from pendulum_twin.signals import Signals, join_signals

SLIP_S = 9.995


def make_signals(effects: dict, seed: int) -> Signals:
    return record_hidden(effects, seed, 20.0)[0].signals


def make_slip(angle_rad: float, seed: int) -> Signals:
    slip = {"angle_rad": angle_rad, "time_s": SLIP_S}
    return make_signals({"encoder_slip": slip}, seed)


def find_steps(signals: Signals) -> tuple[AngleStep, ...]:
    return find_angle_steps(signals, smooth_state(signals).noise.pole_rad)


@pytest.mark.parametrize("angle", [0.02, -0.05, 0.4])
@pytest.mark.parametrize("seed", [1, 2])
def test_a_slip_is_found_to_the_sample(angle: float, seed: int) -> None:
    first = find_steps(make_slip(angle, seed))[0]
    assert first.time_s == pytest.approx(SLIP_S, abs=1e-6)
    assert first.angle_rad == pytest.approx(angle, abs=0.006)


def test_a_slip_of_five_steps_of_a_coarse_encoder_is_found() -> None:
    step = 2 * np.pi / 1024
    for seed in range(1, 5):
        signals = make_slip(5 * step, seed)
        coarse = replace(signals, pole=np.round(signals.pole / step) * step)
        first = find_steps(coarse)[0]
        assert first.time_s == pytest.approx(SLIP_S, abs=1e-6)
        assert first.angle_rad == pytest.approx(5 * step, abs=2 * step)


@pytest.mark.parametrize(
    "effects", [{}, {"cart_coulomb_friction": {"level_n": 1.0}}], ids=["smooth", "sticking"]
)
def test_fast_motion_is_no_slip(effects: dict) -> None:
    steps = find_steps(make_signals(effects, 3))
    assert all(abs(step.angle_rad) < 0.02 for step in steps)


def test_a_slip_so_clear_that_a_stretch_begins_with_it_is_found() -> None:
    signals = make_slip(0.4, 1).break_at([1000])
    first = find_steps(signals)[0]
    assert first.time_s == pytest.approx(SLIP_S, abs=1e-6)
    assert first.angle_rad == pytest.approx(0.4, abs=0.006)


def test_a_clear_slip_is_cleaned_into_no_gap_that_hides_it() -> None:
    t = np.arange(2000) * 0.01
    pole = np.pi + 0.1 * np.sin(2.0 * t)  # slow: the slip is no motion
    pole += 0.13 * (t > SLIP_S)
    recording = Recording.from_arrays(t, None, None, pole)
    assert recording.signals.stretch_begins == (0, 1000)
    (step,) = find_angle_steps(recording.signals, 4e-4)
    assert (step.time_s, step.angle_rad) == pytest.approx((SLIP_S, 0.13), abs=1e-3)


def test_nothing_is_asked_where_another_recording_begins() -> None:
    first, second = make_signals({}, 1), make_signals({}, 2)
    moved = replace(second, pole=second.pole + 0.4)
    joined = join_signals([first, moved])
    seam_s = float(first.clock_s[-1])
    assert all(abs(step.time_s - seam_s) > 0.1 for step in find_angle_steps(joined, 4e-4))


def test_nothing_is_asked_across_a_gap_or_of_a_cart_alone() -> None:
    signals = make_slip(0.4, 1)
    gap = replace(signals, stretch_begins=(0, 1000), begin_s=(0.0, 15.0))
    assert all(abs(step.time_s - SLIP_S) > 0.2 for step in find_angle_steps(gap, 4e-4))
    assert find_angle_steps(replace(signals, pole=None), None) == ()
