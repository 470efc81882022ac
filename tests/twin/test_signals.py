"""Signals: validated, read-only, joined."""

from dataclasses import replace

import numpy as np
import pytest
from support.twin_rigs import recording

from pendulum_twin.errors import BadInputError
from pendulum_twin.signals import join_signals

GOOD = recording(np.linspace(0.0, 0.4, 5), 0.01)


def test_arrays_are_copies_that_cannot_be_written():
    command = np.zeros(5)
    signals = recording(command, 0.01)
    command[:] = 1.0
    assert np.all(signals.command == 0.0)
    with pytest.raises(ValueError, match="read-only"):
        signals.cart[0] = 1.0


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"cart": None, "pole": None}, "expected a cart or a pole"),
        ({"period_s": 0.0}, "above 0 s"),
        ({"period_s": float("nan")}, "above 0 s"),
        ({"cart": np.zeros(4)}, "5 samples of cart"),
        ({"pole_valid": np.ones((5, 1), dtype=bool)}, "5 samples of pole_valid"),
        ({"pole": np.array([0, 1, np.nan, 3, 4])}, "finite values of pole"),
        ({"command": np.array([0, 1, np.inf, 3, 4])}, "finite values of command"),
        ({"stretch_begins": (1, 3)}, "rising stretch_begins"),
        ({"stretch_begins": (0, 3, 2)}, "rising stretch_begins"),
        ({"stretch_begins": (0, 5)}, "rising stretch_begins"),
        ({"stretch_begins": ()}, "rising stretch_begins"),
    ],
)
def test_what_is_wrong_is_refused(change, sentence):
    with pytest.raises(BadInputError, match=sentence):
        replace(GOOD, **change)


def test_stretches_cover_the_recording():
    signals = replace(GOOD, stretch_begins=(0, 2, 3))
    assert signals.stretches == (slice(0, 2), slice(2, 3), slice(3, 5))
    assert signals.seconds == pytest.approx(0.05)
    assert len(signals) == 5


def test_joined_recordings_keep_their_stretches():
    both = join_signals([replace(GOOD, stretch_begins=(0, 2)), GOOD])
    assert both.stretch_begins == (0, 2, 5)
    assert np.array_equal(both.command, np.tile(GOOD.command, 2))
    assert join_signals([GOOD]) is GOOD


def test_recordings_that_differ_are_not_joined():
    with pytest.raises(BadInputError, match="one rate"):
        join_signals([GOOD, replace(GOOD, period_s=0.02)])
    with pytest.raises(BadInputError, match="same joints"):
        join_signals([GOOD, replace(GOOD, pole=None)])


def test_samples_have_times_on_the_clock_of_their_recording():
    gapped = replace(GOOD, stretch_begins=(0, 2), begin_s=(0.0, 1.0))
    assert gapped.clock_s == pytest.approx([0.0, 0.01, 1.0, 1.01, 1.02])
    assert gapped.end_s == pytest.approx(1.03)
    assert GOOD.clock_s == pytest.approx([0.0, 0.01, 0.02, 0.03, 0.04])


def test_times_go_on_from_one_recording_to_the_next_and_the_clock_begins_anew():
    both = join_signals([GOOD, GOOD])
    assert both.clock_s[5:] == pytest.approx(GOOD.clock_s)
    assert both.times_s == pytest.approx(0.01 * np.arange(10))


def test_a_recording_can_be_broken_anywhere_and_keeps_its_times():
    gapped = replace(GOOD, stretch_begins=(0, 2), begin_s=(0.0, 1.0))
    broken = gapped.break_at([1, 4, 2])
    assert broken.stretch_begins == (0, 1, 2, 4)
    assert broken.clock_s == pytest.approx(gapped.clock_s)
    assert broken.times_s == pytest.approx(gapped.times_s)
