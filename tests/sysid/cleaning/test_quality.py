"""Faults are found where they were put; a clean recording comes out as it went in."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.wraps import unwrap
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.records import QualityFinding, Recording
from pendulum_twin.errors import BadInputError

Make = Callable[..., RawRecording]
Motion = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]]

STAMPS = np.arange(3000) / 100


def found(recording: Recording) -> dict[str, QualityFinding]:
    return {f.kind: f for f in recording.findings}


def rows(raw: RawRecording, keep: np.ndarray) -> dict[str, object]:
    """Return the samples that are kept, with all commands."""
    assert raw.cart is not None
    assert raw.pole is not None
    return {
        "state_stamp_s": raw.state_stamp_s[keep],
        "cart": raw.cart[keep],
        "pole": raw.pole[keep],
    }


def with_rows(recording: Make, keep: np.ndarray) -> RawRecording:
    raw = recording(STAMPS)
    return recording(STAMPS, **rows(raw, keep))


def check_unchanged(raw: RawRecording, out: Recording) -> None:
    np.testing.assert_array_equal(out.signals.cart, raw.cart)
    np.testing.assert_array_equal(out.signals.pole, raw.pole)
    np.testing.assert_array_equal(out.signals.command, raw.command)
    assert out.signals.cart_valid.all()
    assert out.signals.pole_valid.all()
    assert out.signals.stretch_begins == (0,)


# Clean recordings


@pytest.mark.parametrize("rate_hz", [31.25, 100, 250, 1000])
def test_a_clean_recording_comes_out_as_it_went_in(recording: Make, rate_hz: float) -> None:
    raw = recording(np.arange(3000) / rate_hz)
    out = clean_recording(raw)
    check_unchanged(raw, out)
    assert out.findings == ()
    assert out.signals.period_s == pytest.approx(1 / rate_hz, rel=1e-9)
    assert (out.name, out.digest) == (raw.name, raw.digest)


@pytest.mark.parametrize("noise", [1e-4, 2e-3])
def test_noise_is_no_fault(recording: Make, noise: float) -> None:
    raw = recording(STAMPS)
    rng = np.random.default_rng(1)
    raw = recording(
        STAMPS,
        cart=raw.cart + rng.normal(0, noise, 3000),
        pole=raw.pole + rng.normal(0, noise, 3000),
    )
    out = clean_recording(raw)
    check_unchanged(raw, out)
    assert out.findings == ()


def stops_and_sticks(stamps: np.ndarray, command: np.ndarray) -> np.ndarray:
    """Make a cart with dry friction between two hard stops, left at half the speed."""
    x, v, step = 0.0, 0.0, stamps[1] / 20
    out = []
    for u in command:
        out.append(x)
        for _ in range(20):
            force = 12 * u
            friction = 1.5 * np.sign(v) if v else np.clip(force, -1.5, 1.5)
            before = v
            v += step * (force - friction - 0.5 * v) / 0.6
            if before * v < 0 and abs(force) < 1.5:
                v = 0.0
            x += step * v
            if abs(x) > 0.1 and x * v > 0:
                v *= -0.5
    return np.array(out)


@pytest.mark.parametrize("wave", ["sine", "square", "random"])
@pytest.mark.parametrize("quantum", [57e-6, 1e-3, 1e-12])
def test_hard_stops_and_dry_friction_are_no_fault(
    recording: Make, wave: str, quantum: float
) -> None:
    sine = np.sin(2 * np.pi * 0.6 * STAMPS)
    noise = np.repeat(np.random.default_rng(3).uniform(-0.5, 0.5, 430), 7)[:3000]
    command = {"sine": 0.4 * sine, "square": 0.5 * np.sign(sine), "random": noise}[wave]
    cart = np.floor(stops_and_sticks(STAMPS, command) / quantum) * quantum
    raw = recording(STAMPS, cart=cart, command=command)
    out = clean_recording(raw)
    check_unchanged(raw, out)
    assert out.findings == ()


def test_a_rig_at_rest_is_no_fault(recording: Make) -> None:
    raw = recording(STAMPS)
    moving = STAMPS > 10
    assert raw.cart is not None
    assert raw.pole is not None
    raw = recording(
        STAMPS,
        cart=np.where(moving, raw.cart, raw.cart[1001]),
        pole=np.where(moving, raw.pole, raw.pole[1001]),
    )
    out = clean_recording(raw)
    check_unchanged(raw, out)
    assert out.findings == ()


def test_a_part_that_is_not_there_stays_out(recording: Make) -> None:
    none = np.empty(0)
    pole_alone = clean_recording(
        recording(STAMPS, cart=None, command_stamp_s=none, command=none)
    ).signals
    assert pole_alone.cart is None
    assert pole_alone.pole_valid.all()
    assert not pole_alone.command.any()
    assert clean_recording(recording(STAMPS, pole=None)).signals.pole is None


# Spikes and jumps


@pytest.mark.parametrize(("size_m", "size_rad"), [(0.04, 0.3), (0.1, 1.0), (5.0, 300.0)])
@pytest.mark.parametrize("width", [1, 2, 3])
def test_spikes_are_found_and_filled(
    recording: Make, motion: Motion, size_m: float, size_rad: float, width: int
) -> None:
    raw = recording(STAMPS)
    places = np.arange(150, 2900, 250)
    hit = (places[:, None] + np.arange(width)).ravel()
    cart, pole = raw.cart.copy(), raw.pole.copy()
    cart[hit] += size_m
    pole[hit + 40] -= size_rad
    out = clean_recording(recording(STAMPS, cart=cart, pole=pole))
    assert np.flatnonzero(~out.signals.cart_valid).tolist() == hit.tolist()
    assert np.flatnonzero(~out.signals.pole_valid).tolist() == (hit + 40).tolist()
    assert found(out)["spike"].count == 2 * len(places)
    assert found(out)["spike"].intervals_s[0] == (1.5, STAMPS[150 + width - 1])
    _, true_cart, true_pole = motion(STAMPS)
    assert np.abs(out.signals.cart - true_cart).max() < 2e-3
    assert np.abs(out.signals.pole - true_pole).max() < 0.01


def test_small_spikes_in_smooth_motion_are_found(recording: Make) -> None:
    raw = recording(np.arange(3000) / 250)
    pole = raw.pole.copy()
    pole[500::500] += 0.03
    assert np.flatnonzero(
        ~clean_recording(recording(raw.state_stamp_s, pole=pole)).signals.pole_valid
    ).tolist() == [*range(500, 3000, 500)]


@pytest.mark.parametrize("sizes_m", [(0.1, 0.02), (0.02, 0.1), (0.3, 0.2, 0.05)])
def test_a_spike_of_uneven_samples_is_one(recording: Make, sizes_m: tuple[float, ...]) -> None:
    cart, hit = recording(STAMPS).cart.copy(), np.arange(150, 2900, 250)
    for k, size_m in enumerate(sizes_m):
        cart[hit + k] += size_m
    out = clean_recording(recording(STAMPS, cart=cart))
    largest = int(np.argmax(sizes_m))
    assert out.signals.stretch_begins == (0,) and not out.signals.cart_valid[hit + largest].any()


def test_half_a_turn_off_for_a_sample_is_a_spike(recording: Make) -> None:
    """A reading of 0 of a pole that hangs: away and back may both be the same way round."""
    pole = np.pi + 0.004 * np.random.default_rng(2).standard_normal(3000)
    hit = np.arange(150, 2900, 250)
    pole[hit] = 0.0
    out = clean_recording(recording(STAMPS, pole=pole))
    assert (
        out.signals.stretch_begins == (0,)
        and np.flatnonzero(~out.signals.pole_valid).tolist() == hit.tolist()
    )


@pytest.mark.parametrize("size_rad", [0.05, 0.055, 0.06, 0.07])
def test_a_small_step_that_stays_is_no_spike(recording: Make, size_rad: float) -> None:
    """An encoder's count slips, in fast motion and coarsely counted: it does not come back."""
    count, swing = 2 * np.pi / 1024, np.pi + 0.7 * np.sin(2 * np.pi * 0.9 * STAMPS)
    for at in range(1000, 1111, 2):
        pole = swing + np.where(np.arange(3000) >= at, size_rad, 0.0)
        out = clean_recording(recording(STAMPS, pole=np.floor(pole / count) * count))
        assert out.signals.pole_valid.all() and "spike" not in found(out), at


def test_first_and_last_samples_of_another_run_are_spikes(recording: Make) -> None:
    raw = recording(STAMPS)
    cart, pole = raw.cart.copy(), raw.pole.copy()
    cart[:2] += 0.15
    pole[-1] -= 1.5
    out = clean_recording(recording(STAMPS, cart=cart, pole=pole))
    assert np.flatnonzero(~out.signals.cart_valid).tolist() == [0, 1]
    assert np.flatnonzero(~out.signals.pole_valid).tolist() == [2999]
    assert out.signals.stretch_begins == (0,)
    assert abs(out.signals.cart[0] - raw.cart[0]) < 3e-3
    assert found(out)["spike"].intervals_s == ((0.0, 0.01), (29.99, 29.99))


def test_a_run_before_is_left_out_though_the_poles_jump_looks_like_a_spike() -> None:
    """The pole seems to come back: its last samples before the jump are out of line."""
    n, own = 3000, 68
    t = np.arange(n) * 0.01
    cart = 0.1 * np.maximum(t - t[own], 0.0) ** 2 * np.exp(-t)
    pole = np.pi + np.where(t > t[own], 0.02 * np.sin(5.0 * (t - t[own])), 0.0)
    cart[:own] = -0.126 - 0.04 * (t[:own] - t[own]) + 0.3 * (t[:own] - t[own]) ** 2
    pole[:own] = np.pi + 0.57 + 7.0 * (t[:own] - t[own])
    out = clean_recording(RawRecording("two runs", "sha256:1", t, cart, pole, t, np.zeros(n)))
    assert found(out)["stale"].intervals_s == ((0.0, 0.67),)
    assert out.signals.begin_s == (pytest.approx(0.68),)


def test_one_spike_in_several_sensors_is_one(recording: Make) -> None:
    raw = recording(STAMPS)
    cart, pole = raw.cart.copy(), raw.pole.copy()
    cart[700] += 0.3
    pole[700] += 1.0
    out = clean_recording(
        recording(STAMPS, cart=cart, pole=pole, cart_velocity=np.gradient(cart, 0.01))
    )
    assert found(out)["spike"].count == 1


def test_a_velocity_spike_invalidates_nothing(recording: Make) -> None:
    velocity = np.gradient(recording(STAMPS).pole, 0.01)
    velocity[0] = 3140.0
    velocity[[800, 1200]] = -628.0
    out = clean_recording(recording(STAMPS, pole_velocity=velocity))
    assert found(out)["spike"].count == 3
    assert out.signals.pole_valid.all()


def test_a_jump_that_stays_begins_a_new_stretch(recording: Make) -> None:
    raw = recording(STAMPS)
    cart = raw.cart + np.where(STAMPS > 12.345, 0.2, 0.0)
    out = clean_recording(recording(STAMPS, cart=cart))
    assert out.signals.stretch_begins == (0, 1235)
    assert out.signals.cart_valid.all()
    assert found(out)["gap"].intervals_s == ((12.34, 12.35),)
    np.testing.assert_array_equal(out.signals.cart, cart)


def test_a_row_without_any_position_is_no_sample(recording: Make) -> None:
    """A file may hold a row for each message, of other sensors as well."""
    raw = recording(STAMPS)
    assert raw.cart is not None
    assert raw.pole is not None
    values = {
        "state_stamp_s": np.insert(STAMPS, 500, STAMPS[499] + 0.004),
        "cart": np.insert(raw.cart, 500, np.nan),
        "pole": np.insert(raw.pole, 500, np.nan),
    }
    out = clean_recording(recording(STAMPS, **values))
    check_unchanged(raw, out)
    assert out.findings == ()


# Angles


@pytest.mark.parametrize("low", [-np.pi, 0.0])
def test_a_wrapped_angle_is_unwrapped_and_its_wraps_counted(recording: Make, low: float) -> None:
    pole = np.pi + 4 * np.sin(2 * np.pi * 0.25 * STAMPS)
    wrapped = np.mod(pole - low, 2 * np.pi) + low
    out = clean_recording(recording(STAMPS, pole=wrapped))
    turns = np.diff(np.floor((pole - low) / (2 * np.pi)))
    assert found(out)["wrap"].count == np.count_nonzero(turns)
    np.testing.assert_allclose(np.diff(out.signals.pole), np.diff(pole), atol=1e-12)
    assert out.signals.pole[0] == pytest.approx(np.pi)


def test_a_spike_at_a_wrap_does_not_hide_it(recording: Make) -> None:
    pole = np.pi + 4 * np.sin(2 * np.pi * 0.25 * STAMPS)
    wrapped = np.mod(pole + np.pi, 2 * np.pi) - np.pi
    at = int(np.flatnonzero(np.abs(np.diff(wrapped)) > 6)[3]) + 1
    wrapped[at] += 2.0
    out = clean_recording(recording(STAMPS, pole=wrapped))
    assert np.flatnonzero(~out.signals.pole_valid).tolist() == [at]
    assert out.signals.stretch_begins == (0,)
    assert np.ptp(out.signals.pole - pole) < 0.01


@pytest.mark.parametrize(
    ("first", "expected"),
    [(-3.1, 2 * np.pi - 3.1), (6.2, 6.2 - 2 * np.pi), (9.4, 9.4 - 2 * np.pi), (0.1, 0.1)],
)
def test_an_angle_begins_on_a_branch_near_hanging(first: float, expected: float) -> None:
    angle, wraps = unwrap(np.full(20, first))
    assert angle == pytest.approx(np.full(20, expected))
    assert len(wraps) == 0


@pytest.mark.parametrize(("turns", "count"), [(0.9, 1), (0.6, 0), (-0.9, 1), (-1.4, 0)])
def test_only_a_step_of_about_whole_turns_is_a_wrap(turns: float, count: int) -> None:
    """Any other step is taken for the shortest one, too, and is a spike or a jump."""
    angle, wraps = unwrap(np.repeat([np.pi, np.pi + 2 * np.pi * turns], 10))
    assert wraps.tolist() == [9] * count
    assert np.ptp(angle) == pytest.approx(abs(turns - round(turns)) * 2 * np.pi)


# Times


def test_a_few_lost_samples_are_filled(recording: Make, motion: Motion) -> None:
    keep = np.ones(3000, dtype=bool)
    keep[[100, 500, 501, 900, 901, 902, 903, 904]] = False
    out = clean_recording(with_rows(recording, keep))
    assert len(out.signals) == 3000
    assert out.signals.stretch_begins == (0,)
    np.testing.assert_array_equal(out.signals.cart_valid, keep)
    np.testing.assert_array_equal(out.signals.pole_valid, keep)
    np.testing.assert_array_equal(out.signals.cart[keep], recording(STAMPS).cart[keep])
    np.testing.assert_array_equal(out.signals.command, recording(STAMPS).command)
    assert found(out)["gap"].intervals_s == ((0.99, 1.01), (4.99, 5.02), (8.99, 9.05))
    assert np.abs(out.signals.pole - motion(STAMPS)[2]).max() < 0.02


def test_five_percent_lost_at_random_are_handled(recording: Make, motion: Motion) -> None:
    keep = np.random.default_rng(5).random(3000) > 0.05
    keep[[0, -1]] = True
    out = clean_recording(with_rows(recording, keep))
    assert out.signals.stretch_begins == (0,)
    np.testing.assert_array_equal(out.signals.cart_valid, keep)
    assert set(found(out)) == {"gap"}
    assert np.abs(out.signals.pole - motion(STAMPS)[2]).max() < 0.02


def test_five_percent_lost_and_spikes_together_are_handled(recording: Make) -> None:
    keep = np.random.default_rng(6).random(3000) > 0.05
    keep[300::300] = True
    raw = recording(STAMPS)
    pole = raw.pole.copy()
    pole[300::300] += 0.7
    out = clean_recording(recording(STAMPS, **{**rows(raw, keep), "pole": pole[keep]}))
    spikes = np.zeros(3000, dtype=bool)
    spikes[300::300] = True
    np.testing.assert_array_equal(out.signals.pole_valid, keep & ~spikes)
    np.testing.assert_array_equal(out.signals.cart_valid, keep)


def test_a_long_gap_begins_a_new_stretch(recording: Make) -> None:
    keep = np.ones(3000, dtype=bool)
    keep[1000:1006] = False
    out = clean_recording(with_rows(recording, keep))
    assert out.signals.stretch_begins == (0, 1000)
    assert out.signals.cart_valid.all()
    np.testing.assert_array_equal(out.signals.command, recording(STAMPS).command[keep])
    assert found(out)["gap"].intervals_s == ((9.99, 10.06),)


def test_a_stretch_too_short_to_say_anything_is_left_out(recording: Make) -> None:
    keep = np.ones(3000, dtype=bool)
    keep[1000:1100] = keep[1105:1200] = False
    out = clean_recording(with_rows(recording, keep))
    assert out.signals.stretch_begins == (0, 1000)
    assert len(out.signals) == 2800


def test_values_that_are_not_finite_are_missing(recording: Make) -> None:
    raw = recording(STAMPS)
    cart, command = raw.cart.copy(), raw.command.copy()
    cart[200:203] = np.nan
    command[400] = np.inf
    out = clean_recording(recording(STAMPS, cart=cart, command=command))
    assert np.flatnonzero(~out.signals.cart_valid).tolist() == [200, 201, 202]
    assert out.signals.pole_valid.all()
    assert out.signals.command[400] == raw.command[399]
    assert found(out)["gap"].intervals_s == ((2.0, 2.02), (4.0, 4.0))


def test_what_the_index_counts_and_the_file_lacks_is_a_gap_at_the_end(recording: Make) -> None:
    for changes in ({"lost_messages": 12}, {"cut_short": True}):
        assert found(clean_recording(recording(STAMPS, **changes)))["gap"].intervals_s == (
            (29.99, 29.99),
        )


def test_samples_that_came_twice_count_once(recording: Make) -> None:
    twice = np.sort(np.concatenate([np.arange(3000), [7, 7, 1500]]))
    out = clean_recording(with_rows(recording, twice))
    check_unchanged(recording(STAMPS), out)
    assert found(out)["stale"].count == 2


def test_stamps_that_jitter_are_put_on_a_uniform_clock(recording: Make, motion: Motion) -> None:
    stamps = STAMPS + np.random.default_rng(7).uniform(-0.003, 0.003, 3000)
    stamps -= stamps[0]
    out = clean_recording(recording(stamps))
    grid = np.arange(len(out.signals)) * out.signals.period_s
    assert out.signals.stretch_begins == (0,)
    assert out.signals.cart_valid.mean() > 0.999
    assert out.signals.period_s == pytest.approx(0.01, rel=1e-4)
    assert found(out)["jitter"].intervals_s == ((0.0, stamps[-1]),)
    offset = min(
        np.linspace(-0.01, 0.01, 201),
        key=lambda d: np.abs(motion(grid + d)[2] - out.signals.pole).mean(),
    )
    assert np.abs(motion(grid + offset)[2] - out.signals.pole).max() < 0.01


def test_little_jitter_is_no_finding(recording: Make) -> None:
    stamps = STAMPS + np.random.default_rng(8).uniform(-1e-3, 1e-3, 3000)
    assert clean_recording(recording(stamps - stamps[0])).findings == ()


def test_stamps_nearly_on_the_grid_leave_the_values_unchanged(recording: Make) -> None:
    raw = recording(STAMPS)
    stamps = STAMPS + np.random.default_rng(9).uniform(-1e-4, 1e-4, 3000)
    out = clean_recording(recording(STAMPS, state_stamp_s=stamps - stamps[0]))
    check_unchanged(raw, out)


def test_a_clock_that_runs_slow_makes_no_drift(recording: Make) -> None:
    stamps = np.arange(3000) / 100 * 1.00002406
    out = clean_recording(recording(stamps))
    check_unchanged(recording(stamps), out)
    assert out.signals.period_s == pytest.approx(0.0100002406, rel=1e-7)


# A frozen driver


def test_a_frozen_driver_is_found(recording: Make) -> None:
    raw = recording(STAMPS)
    cart, pole = raw.cart.copy(), raw.pole.copy()
    cart[1000:1085], pole[1000:1085] = cart[1000], pole[1000]
    out = clean_recording(recording(STAMPS, cart=cart, pole=pole))
    assert found(out)["stale"].intervals_s == ((10.01, 10.84),)
    assert set(found(out)) == {"stale"}
    assert out.signals.stretch_begins == (0, 1001)
    np.testing.assert_array_equal(out.signals.pole, np.delete(raw.pole, np.arange(1001, 1085)))


def test_a_cart_stuck_under_a_moving_pole_is_no_fault(recording: Make) -> None:
    raw = recording(STAMPS)
    cart = raw.cart.copy()
    cart[1000:1200] = cart[1000]
    cart[1200:] += cart[1000] - raw.cart[1200]
    out = clean_recording(recording(STAMPS, cart=cart))
    assert "stale" not in found(out)


# Commands


def test_a_command_belongs_to_the_sample_it_came_with(recording: Make) -> None:
    raw = recording(STAMPS)
    late = np.random.default_rng(10).uniform(-0.002, 0.002, 3000)
    out = clean_recording(recording(STAMPS, command_stamp_s=STAMPS + late))
    np.testing.assert_array_equal(out.signals.command, raw.command)


def test_a_command_between_samples_is_averaged(recording: Make) -> None:
    raw = recording(STAMPS)
    out = clean_recording(recording(STAMPS, command_stamp_s=STAMPS + 0.004))
    expected = 0.4 * np.concatenate([[0.0], raw.command[:-1]]) + 0.6 * raw.command
    np.testing.assert_allclose(out.signals.command, expected, atol=1e-12)


def test_a_slow_command_is_held(recording: Make) -> None:
    raw = recording(STAMPS)
    out = clean_recording(
        recording(STAMPS, command_stamp_s=STAMPS[50::10], command=raw.command[50::10])
    )
    np.testing.assert_array_equal(out.signals.command[:50], 0.0)
    np.testing.assert_array_equal(out.signals.command[50:], np.repeat(raw.command[50::10], 10))


def test_a_fast_command_is_averaged(recording: Make) -> None:
    stamps = np.arange(30_000) / 1000
    command = np.sin(stamps)
    out = clean_recording(recording(STAMPS, command_stamp_s=stamps, command=command))
    np.testing.assert_allclose(
        out.signals.command, command.reshape(-1, 10).mean(axis=1), atol=1e-9
    )


def test_a_command_before_the_recording_is_held_into_it(recording: Make) -> None:
    out = clean_recording(
        recording(STAMPS, command_stamp_s=np.array([-3.0]), command=np.array([0.2]))
    )
    np.testing.assert_array_equal(out.signals.command, 0.2)


def test_a_clipped_command_is_told(recording: Make) -> None:
    command = np.clip(0.6 * np.sin(2 * np.pi * 0.5 * STAMPS), -0.5, 0.5)
    finding = found(clean_recording(recording(STAMPS, command=command)))["clipped"]
    assert finding.count == 30
    begin, end = finding.intervals_s[0]
    assert (begin, end) == pytest.approx((0.32, 0.68), abs=0.02)


@pytest.mark.parametrize("levels", [(0.5, -0.5), (0.5, 0.0, -0.5, 0.25)])
def test_steps_are_not_clipped(recording: Make, levels: tuple[float, ...]) -> None:
    command = np.array(levels)[(STAMPS // 1.5).astype(int) % len(levels)]
    assert clean_recording(recording(STAMPS, command=command)).findings == ()


def test_a_command_that_leaps_to_its_limit_from_the_other_side_is_not_clipped(
    recording: Make,
) -> None:
    """It glides near the lower limit, and goes at once to the upper."""
    place = np.arange(3000) % 15
    command = np.where(place < 10, -0.48 + 0.003 * place, 0.5)
    assert clean_recording(recording(STAMPS, command=command)).findings == ()


# Too little


@pytest.mark.parametrize("stamps", [np.arange(90) / 10, np.arange(150) / 100])
def test_too_little_is_refused(recording: Make, stamps: np.ndarray) -> None:
    with pytest.raises(
        BadInputError,
        match=f"expected at least 100 usable samples and 2 s, found {len(stamps)} samples",
    ):
        clean_recording(recording(stamps))


def test_a_recording_of_gaps_is_refused(recording: Make) -> None:
    with pytest.raises(BadInputError, match="expected at least 100 usable samples"):
        clean_recording(with_rows(recording, np.arange(3000) % 60 < 5))


# A real rig


def test_the_real_rig_s_faults_are_found(shared_data: Path) -> None:
    out = clean_recording(read_bag(shared_data / "inteco_rig" / "open_loop_0_60s"))
    assert len(out.signals) == 6000
    assert out.signals.period_s == 0.01
    assert out.signals.cart_valid.all()
    assert out.signals.pole_valid.all()
    assert {f.kind: f.count for f in out.findings} == {"spike": 1, "wrap": 73}
    assert found(out)["spike"].intervals_s == ((0.0, 0.0),)  # its first velocity is 3140 rad/s
    assert np.abs(np.diff(out.signals.pole)).max() < 0.2
