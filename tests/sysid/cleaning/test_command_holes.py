"""Where commands are missing, what drove the cart is unknown: said, and left out."""

import numpy as np
import pytest
from support.degraded import keep_commands, make_raw

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.reading.raw import RawRecording

RAW = make_raw(30.0)
AT = RAW.command_stamp_s


def hold_rests(raw: RawRecording, begin_s: float, end_s: float) -> RawRecording:
    """Command 0 in an interval; the motion stays what it was."""
    command = raw.command.copy()
    command[(begin_s <= AT) & (end_s > AT)] = 0.0
    return RawRecording("made", "sha256:1", AT, raw.cart, raw.pole, AT, command)


def find_gaps(raw: RawRecording) -> list[tuple[float, float]]:
    return [
        span
        for finding in clean_recording(raw).findings
        if finding.kind == "gap" and "what drove the cart" in finding.note
        for span in finding.intervals_s
    ]


def test_a_hole_is_left_out() -> None:
    raw = keep_commands(RAW, (AT < 10.0) | (AT > 13.0))
    [(begin_s, end_s)] = find_gaps(raw)
    assert begin_s == pytest.approx(10.0, abs=0.02) and end_s == pytest.approx(13.2, abs=0.02)
    signals = clean_recording(raw).signals
    assert len(signals.stretches) == 2
    assert not np.any((signals.clock_s > 10.01) & (signals.clock_s < 13.19))


def test_commands_that_end_early_end_the_recording() -> None:
    raw = keep_commands(RAW, AT < 18.0)
    assert clean_recording(raw).signals.clock_s[-1] == pytest.approx(18.0, abs=0.03)


def test_a_rig_that_moves_as_if_commanded_after_the_last_0_is_left_out() -> None:
    raw = keep_commands(hold_rests(RAW, 17.9, 18.0), AT < 18.0)
    assert clean_recording(raw).signals.clock_s[-1] == pytest.approx(18.0, abs=0.03)


def test_a_rig_that_is_left_alone_after_a_last_0_stays() -> None:
    at_rest = hold_rests(RAW, 17.0, 30.0)
    cart, pole = RAW.cart.copy(), RAW.pole.copy()
    cart[1700:], pole[1700:] = cart[1700], pole[1700]  # at once, as no rig does: no matter
    random = np.random.default_rng(0)
    cart[1700:] += random.normal(0.0, 5e-5, 1300)
    raw = RawRecording("made", "sha256:1", AT, cart, pole, AT, at_rest.command)
    assert find_gaps(keep_commands(raw, AT < 18.0)) == []


def test_a_few_lost_commands_are_filled_where_the_command_is_smooth() -> None:
    raw = keep_commands(RAW, np.arange(len(AT)) % 100 != 50)
    found = clean_recording(raw)
    assert len(found.signals.stretches) == 1
    assert np.max(np.abs(found.signals.command - RAW.command)) < 0.01 * np.max(RAW.command)


def test_a_lost_command_at_a_step_divides_the_recording() -> None:
    command = RAW.command.copy()
    command[1000:] += 0.2
    raw = RawRecording("made", "sha256:1", AT, RAW.cart, RAW.pole, AT, command)
    found = clean_recording(keep_commands(raw, np.arange(len(AT)) != 1000))
    assert len(found.signals.stretches) == 2


def test_too_many_lost_commands_make_a_recording_unusable() -> None:
    random = np.random.default_rng(0)
    raw = keep_commands(hold_rests(RAW, 0.0, 1.0), random.random(len(AT)) > 0.1)
    with pytest.raises(UnusableRecording, match="expected a command each period"):
        clean_recording(raw)


def test_a_publisher_of_changes_leaves_no_holes() -> None:
    """Commands that are sent when they change have no period."""
    steps = np.array([0, 37, 101, 190, 244, 371, 500, 512, 733, 900, 1404, 1777, 2222, 2900])
    command = np.zeros(len(AT))
    for k in steps:
        command[k:] = 0.1 * np.sin(k)
    raw = RawRecording("made", "sha256:1", AT, RAW.cart, RAW.pole, AT, command)
    assert find_gaps(keep_commands(raw, steps)) == []


def test_a_change_that_is_sent_again_makes_no_holes() -> None:
    """The commands change all the time, and 0.3 lasts through three silences."""
    stamps = np.sort(np.random.default_rng(2).uniform(0.0, AT[-1], 3 * len(AT)))
    command = 0.1 * np.sin(np.pi * stamps)
    kept = np.ones(len(stamps), dtype=bool)
    for begin in (1000, 3000):
        command[begin : begin + 400] = 0.3
        kept[begin + 1 : begin + 400] = False
    kept[1200] = True
    raw = RawRecording("made", "sha256:1", AT, RAW.cart, RAW.pole, stamps, command)
    assert find_gaps(keep_commands(raw, kept)) == []


def test_a_controller_that_falls_silent_leaves_holes_though_its_commands_hardly_repeat() -> None:
    stamps = np.sort(np.random.default_rng(3).uniform(0.0, AT[-1], 3 * len(AT)))
    command = 0.1 * np.sin(np.pi * stamps) + 0.01
    command[:3] = 0.0
    heard = np.ones(len(stamps), dtype=bool)
    for begin_s in (5.0, 10.0, 15.0, 20.0):
        heard &= (stamps < begin_s) | (stamps > begin_s + 0.3)
    raw = RawRecording("made", "sha256:1", AT, RAW.cart, RAW.pole, stamps, command)
    assert len(find_gaps(keep_commands(raw, heard))) == 4


def test_a_rig_that_moves_as_if_commanded_before_the_first_command_is_left_out() -> None:
    raw = keep_commands(RAW, AT > 2.0)
    [(begin_s, end_s)] = find_gaps(raw)
    assert begin_s == pytest.approx(0.0, abs=0.02) and end_s == pytest.approx(2.2, abs=0.02)
    assert clean_recording(raw).signals.clock_s[0] == pytest.approx(2.2, abs=0.03)


def test_a_driver_that_falls_silent_leaves_a_hole() -> None:
    """It publishes unevenly, several commands a sample: another program may have spoken."""
    random = np.random.default_rng(1)
    stamps = np.sort(random.uniform(0.0, AT[-1], 3 * len(AT)))
    stamps = stamps[(stamps < 12.0) | (stamps > 12.3)]
    held = np.searchsorted(AT, stamps, side="right") - 1
    command = RAW.command[held]
    raw = RawRecording("made", "sha256:1", AT, RAW.cart, RAW.pole, stamps, command)
    [(begin_s, end_s)] = find_gaps(raw)
    assert begin_s == pytest.approx(12.0, abs=0.02) and end_s == pytest.approx(12.5, abs=0.02)
