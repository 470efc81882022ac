"""Recordings that are joined keep what each says."""

from dataclasses import replace

import pytest
from support.made_recordings import INTECO, made, without_joint

from pendulum_sysid.cleaning.joining import join_recordings
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.records import CommandLatency, QualityFinding

CUT, HOLE = "the file ends before its end mark", "commands are missing"


def test_the_worst_latency_and_every_note_stay() -> None:
    first, second = made(INTECO, 5.0), made(INTECO, 5.0, seed=1)
    first = replace(
        first,
        command_latency=CommandLatency(0.02, 0.001),
        findings=(QualityFinding("gap", 1, ((1.0, 1.2),), CUT),),
    )
    second = replace(
        second,
        command_latency=CommandLatency(0.01, 0.004),
        findings=(QualityFinding("gap", 1, ((2.0, 2.2),), HOLE), QualityFinding("slip", 1)),
    )
    joined = join_recordings([first, second, first])
    assert joined.command_latency == CommandLatency(0.01, 0.004)
    assert joined.losses == f"{CUT}; {HOLE}"
    gap, slip = joined.findings
    assert (gap.count, gap.note, slip.kind) == (3, f"{CUT}; {HOLE}", "slip")


def test_findings_are_told_at_times_through_all_recordings_with_their_pauses() -> None:
    first, second = made(INTECO, 5.0), made(INTECO, 5.0, seed=1)
    paused = replace(first.signals, stretch_begins=(0, 200), begin_s=(0.0, 4.0))
    gap = QualityFinding("gap", 1, ((2.0, 4.0),))
    first = replace(first, signals=paused, findings=(gap,))
    second = replace(second, findings=(replace(gap, intervals_s=((1.0, 1.2),)),))
    (joined,) = join_recordings([first, second]).findings
    (_, again) = joined.intervals_s
    assert again == pytest.approx((8.0, 8.2))  # 2 s, a pause of 2 s, and 3 s


def test_recordings_that_say_no_latency_have_none() -> None:
    joined = join_recordings([made(INTECO, 5.0), made(INTECO, 5.0, seed=1)])
    assert joined.command_latency is None


def test_recordings_of_other_joints_say_what_to_do() -> None:
    first = made(INTECO, 5.0)
    with pytest.raises(WrongUse, match="found cart or pole missing in some: diagnose"):
        join_recordings([first, without_joint(first, "pole")])


def test_recordings_of_two_rates_say_by_how_much_speeds_are_off() -> None:
    """Periods of 10 and 10.05 ms were joined in silence: constants were off by as much."""
    first, second = made(INTECO, 5.0), made(INTECO, 5.0, seed=1)
    slow = replace(second, signals=replace(second.signals, period_s=0.01005))
    (uneven,) = join_recordings([first, second, slow]).findings
    assert (uneven.kind, uneven.count) == ("other_rate", 1)
    assert "10 ms" in uneven.note and "off by up to 0.50%" in uneven.note
    close = replace(second, signals=replace(second.signals, period_s=0.010005))
    assert join_recordings([first, close]).findings == ()
