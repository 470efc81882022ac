"""Samples and commands stand at the times at which they were taken and acted."""

from dataclasses import replace

import numpy as np
import pytest
from support.degraded import make_raw, stamp, stamp_commands
from support.made_recordings import INTECO, made_states

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.cleaning.clock import count_parts, hold_commands
from pendulum_sysid.cleaning.even_clock import find_even_clock
from pendulum_sysid.fitting.fit import fit
from pendulum_sysid.prepare import prepare
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.reading.sending_times import find_sending_times
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS, make_theta

RAW = make_raw()
TRUE = clean_recording(RAW).signals
ROUGH = 0.3 * np.random.default_rng(8).uniform(-1.0, 1.0, 400).repeat(5)


@pytest.mark.parametrize("deviation_s", [0.003, 0.01])
def test_samples_that_were_stamped_wrongly_stand_in_their_order(deviation_s: float) -> None:
    random = np.random.default_rng(0)
    off = random.normal(0.0, deviation_s, len(RAW.state_stamp_s))
    found = clean_recording(stamp(RAW, np.sort(RAW.state_stamp_s + off)))
    assert [finding.kind for finding in found.findings] == ["jitter"]
    assert "stand in their order" in found.findings[0].note
    assert found.signals.period_s == pytest.approx(0.01, rel=1e-4)
    assert np.array_equal(found.signals.pole, TRUE.pole)
    assert found.timing_spread_s == pytest.approx(3.3 * deviation_s, rel=0.4)


def test_stamps_that_are_wrong_for_a_while_are_seen_through() -> None:
    """A tenth of the samples decides; the others stand where they belong in either case."""
    random, at = np.random.default_rng(10), RAW.state_stamp_s
    off = np.where((at > 5.0) & (at < 7.0), random.uniform(-0.0015, 0.0015, len(at)), 0.0)
    signals = clean_recording(stamp(RAW, at + off)).signals
    assert len(signals) == len(TRUE) and np.array_equal(signals.cart, TRUE.cart)


def test_stamps_of_the_arrival_with_bursts_are_seen_through() -> None:
    random = np.random.default_rng(1)
    stamps = RAW.state_stamp_s + 0.001 + random.exponential(0.003, len(RAW.state_stamp_s))
    held = (stamps > 5.0) & (stamps < 5.06)
    stamps[held] = 5.06
    found = clean_recording(stamp(RAW, np.maximum.accumulate(stamps)))
    assert len(found.signals) == len(TRUE) and np.array_equal(found.signals.cart, TRUE.cart)


def test_samples_that_were_taken_unevenly_keep_their_stamps() -> None:
    random = np.random.default_rng(2)
    stamps = np.sort(RAW.state_stamp_s + random.normal(0.0, 0.002, len(RAW.state_stamp_s)))
    taken = {
        joint: np.interp(stamps, RAW.state_stamp_s, values)
        for joint, values in RAW.positions.items()
    }
    found = clean_recording(stamp(replace(RAW, **taken), stamps))
    inside = slice(5, -5)
    clean = np.interp(found.signals.clock_s, RAW.state_stamp_s, RAW.pole)
    assert np.std((found.signals.pole - clean)[inside]) < 2e-3  # by their order: 0.01
    assert found.timing_spread_s == 0.0


def test_commands_that_were_logged_late_act_evenly() -> None:
    random = np.random.default_rng(3)
    late = RAW.command_stamp_s + random.uniform(0.0, 0.01, len(RAW.command))
    found = clean_recording(stamp_commands(RAW, late))
    assert np.mean(found.signals.command != TRUE.command) < 0.01
    assert found.timing_spread_s == pytest.approx(0.009, abs=0.0015)


def test_a_delay_is_known_no_better_than_the_times_of_the_commands() -> None:
    recording = clean_recording(RAW)
    theta = make_theta(INTECO)
    theta[SLOTS["input_delay"]] = 0.02
    delays = []
    for spread_s in (0.0, 0.008):
        prepared = prepare([replace(recording, timing_spread_s=spread_s)], INTECO)
        estimates = fit(prepared.case, prepared.split, ("input_delay",), theta).estimates
        delays.append(estimates["input_delay.delay_s"])
    assert BY_NAME["input_delay"].parameters[0].delays
    assert delays[1].high == pytest.approx(delays[0].high + 0.004)
    assert delays[1].low == 0.0  # no delay is negative


def test_commands_between_slow_samples_act_where_they_came() -> None:
    """At 20 Hz, commands at 100 Hz: five act in each period, and runs of the twin feel each."""
    slow = replace(
        RAW,
        state_stamp_s=RAW.state_stamp_s[::5],
        **{joint: values[::5] for joint, values in RAW.positions.items()},
    )
    signals = clean_recording(slow).signals
    assert signals.period_s == pytest.approx(0.05) and signals.command_parts.shape[1] == 5
    assert np.allclose(signals.command_parts.reshape(-1), TRUE.command)
    assert np.allclose(signals.command, TRUE.command.reshape(-1, 5).mean(axis=1))
    held = replace(signals, parts=None)
    errors = {}
    for name, tried in (("parts", signals), ("mean", held)):
        prepared = prepare([replace(clean_recording(slow), signals=tried)], INTECO)
        theta = make_theta(INTECO)
        errors[name] = fit(prepared.case, prepared.split, (), theta).power[0]
    print(f"{errors['parts']:.3g} m^2 in parts, {errors['mean']:.3g} m^2 as their mean")
    assert errors["parts"] < 0.2 * errors["mean"]  # the noise is left


def test_commands_as_often_as_samples_are_held_for_whole_periods() -> None:
    assert TRUE.parts is None and TRUE.command_parts.shape == (len(TRUE), 1)
    assert count_parts(0.01, RAW.command_stamp_s, False) == 1
    # shorter than a step of the search
    assert count_parts(0.001, 1e-4 * np.arange(1000), False) == 1
    assert count_parts(0.01, RAW.command_stamp_s, True) == 4  # anywhere between two instants
    assert count_parts(0.05, 0.001 * np.arange(1000), False) == 20


@pytest.mark.parametrize("lost", [0.0, 0.01, 0.2])
def test_lost_messages_are_counted(lost: float) -> None:
    random = np.random.default_rng(4)
    kept = np.flatnonzero(random.random(2000) >= lost)
    clock = find_even_clock(0.01 * kept)
    assert clock is not None
    assert np.array_equal(clock.numbers, kept - kept[0])


def test_a_long_standstill_with_its_burst_has_lost_nothing() -> None:
    """For 70 ms nothing comes, then samples 2.4 ms apart, until the clock is reached again."""
    late = 0.01 * np.arange(2000)
    late[1000:1012] += 0.01 * np.array(
        [6.2, 6.2, 6.16, 5.4, 4.78, 4.02, 3.26, 2.5, 1.74, 1.04, 0.28, 0.0]
    )
    clock = find_even_clock(late)
    assert clock is not None
    assert np.array_equal(clock.numbers, np.arange(2000))


def test_a_short_standstill_with_its_burst_has_lost_nothing() -> None:
    """Most steps are whole periods; those of a burst are not, and belong to the long step."""
    late, kept = 0.01 * np.arange(2000), np.delete(np.arange(2000), [500, 501])
    late[1000:1005] += 0.01 * np.array([2.0, 1.25, 0.72, 0.4, 0.02])
    clock = find_even_clock(late[kept])
    assert clock is not None
    assert np.array_equal(clock.numbers, kept)


def test_stamps_without_a_period_have_no_clock() -> None:
    random = np.random.default_rng(5)
    assert find_even_clock(np.cumsum(random.pareto(1.0, 500))) is None
    assert find_even_clock(np.zeros(500)) is None


@pytest.mark.parametrize("again", [False, True])
@pytest.mark.parametrize("late_s", [0.0, 0.0007, -0.0007])
def test_the_cart_says_from_which_sample_a_command_acted(late_s: float, again: bool) -> None:
    """A busy computer answers a sample twice, at once and late; its clock of samples is off.

    again: whether it sends every answer twice.
    """
    random = np.random.default_rng(6)
    at, last = RAW.command_stamp_s, np.concatenate([[0.0], ROUGH[:-1]])
    answered = at + random.uniform(-0.0049, 0.0049, len(at))  # each acts from its own sample
    at_once = at + 0.0001
    stamps = np.concatenate([answered, at_once])
    values = np.concatenate([ROUGH, np.where(answered < at_once, ROUGH, last)])
    if again:
        stamps = np.concatenate([stamps, stamps + 0.00005])
        values = np.concatenate([values, values])
    order = np.argsort(stamps, kind="stable")
    raw = answer(stamps[order] + late_s, values[order], ROUGH)
    command = clean_recording(raw).signals.command
    by_stamp = hold_commands(TRUE.clock_s, 0.01, raw.command_stamp_s, raw.command, nearest=True)
    error, stamped = (np.sqrt(np.mean((u - ROUGH) ** 2)) for u in (command, by_stamp))
    print(f"{np.sum(command != ROUGH)} of {len(at)} wrong, {error:.2g} of {stamped:.2g}")
    assert error <= 0.3 * stamped if late_s else np.array_equal(command, ROUGH)


def test_a_lag_of_the_drive_does_not_make_answers_look_averaged() -> None:
    """The driver sends the last command at once, too; a lag smooths the cart's answer."""
    random = np.random.default_rng(11)
    at, last = RAW.command_stamp_s, np.concatenate([[0.0], ROUGH[:-1]])
    stamps = np.concatenate([at + 0.001, at + random.uniform(0.0015, 0.0049, len(at))])
    order = np.argsort(stamps, kind="stable")
    lagging = replace(INTECO, effects={"motor_lag": {"time_constant_s": 0.05}})
    commands = np.concatenate([last, ROUGH])[order]
    found = clean_recording(answer(stamps[order], commands, ROUGH, lagging))
    assert np.mean(found.signals.command != ROUGH) < 0.01


@pytest.mark.parametrize(
    ("effect", "sizes"),
    [("input_saturation", {"limit": 0.2}), ("input_dead_zone", {"width": 0.05})],
)
def test_a_drive_that_does_not_answer_is_no_command_that_acted_later(
    effect: str, sizes: dict[str, float]
) -> None:
    """Beyond a saturation, or within a dead zone, no change of the command moves the cart."""
    random, at = np.random.default_rng(12), RAW.command_stamp_s
    sent = np.where(at < 15.0, 0.4 * ROUGH, 0.35 * np.sin(2 * np.pi * 2.4 * at))
    last = np.concatenate([[0.0], sent[:-1]])
    stamps = np.concatenate([at + 0.001, at + random.uniform(0.0015, 0.0045, len(at))])
    order = np.argsort(stamps, kind="stable")
    bent = replace(INTECO, effects={effect: sizes})
    found = clean_recording(answer(stamps[order], np.concatenate([last, sent])[order], sent, bent))
    print(f"{np.mean(found.signals.command != sent):.3f} of the commands moved")
    assert np.mean(found.signals.command != sent) < 0.005


def test_commands_that_acted_when_they_came_are_averaged() -> None:
    random = np.random.default_rng(7)
    stamps = RAW.command_stamp_s + random.uniform(0.0, 0.0099, len(ROUGH))
    acted = hold_commands(RAW.state_stamp_s, 0.01, stamps, ROUGH, nearest=False)
    signals = clean_recording(answer(stamps, ROUGH, acted)).signals
    assert np.allclose(signals.command, acted)


def answer(stamps: Floats, commands: Floats, acted: Floats, twin: Twin = INTECO) -> RawRecording:
    """Return a recording of commands and of the motion by the commands that acted."""
    cart, pole, _, _ = made_states(twin, acted).T
    random = np.random.default_rng(9)
    cart = np.round(cart + random.normal(0.0, 2e-5, len(cart)), 5)
    return replace(RAW, cart=cart, pole=pole, command_stamp_s=stamps, command=commands)


def test_a_message_counts_from_when_it_was_published() -> None:
    published = [10**18 + 10_000_000 * k for k in range(100)]
    received = [time + 3_000_000 + 1_000_000 * (k % 7) for k, time in enumerate(published)]
    assert find_sending_times(received, published) == [time + 3_000_000 for time in published]


@pytest.mark.parametrize("off_ns", [-5_000_000, 2_000_000_000])
def test_times_of_two_clocks_are_not_compared(off_ns: int) -> None:
    received = [10**18 + 10_000_000 * k for k in range(100)]
    assert find_sending_times(received, [time - off_ns for time in received]) == received
