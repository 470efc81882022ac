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
    ("change", "words"),
    [
        ({"cart": None, "pole": None}, "expected a cart or a pole"),
        ({"period_s": 0.0}, "above 0 s"),
        ({"period_s": float("nan")}, "above 0 s"),
        ({"cart": np.zeros(4)}, "5 samples of cart"),
        ({"pole_valid": np.ones((5, 1), dtype=bool)}, "5 samples of pole_valid"),
        ({"pole": np.array([0, 1, np.nan, 3, 4])}, "finite values of pole"),
        ({"command": np.array([0, 1, np.inf, 3, 4])}, "finite values of command"),
        ({"starts": (1, 3)}, "rising starts"),
        ({"starts": (0, 3, 2)}, "rising starts"),
        ({"starts": (0, 5)}, "rising starts"),
        ({"starts": ()}, "rising starts"),
    ],
)
def test_what_is_wrong_is_refused(change, words):
    with pytest.raises(BadInputError, match=words):
        replace(GOOD, **change)


def test_stretches_cover_the_recording():
    signals = replace(GOOD, starts=(0, 2, 3))
    assert signals.stretches == (slice(0, 2), slice(2, 3), slice(3, 5))
    assert signals.seconds == pytest.approx(0.05)
    assert len(signals) == 5


def test_joined_recordings_keep_their_stretches():
    both = join_signals([replace(GOOD, starts=(0, 2)), GOOD])
    assert both.starts == (0, 2, 5)
    assert np.array_equal(both.command, np.tile(GOOD.command, 2))
    assert join_signals([GOOD]) is GOOD


def test_recordings_that_differ_are_not_joined():
    with pytest.raises(BadInputError, match="one rate"):
        join_signals([GOOD, replace(GOOD, period_s=0.02)])
    with pytest.raises(BadInputError, match="same joints"):
        join_signals([GOOD, replace(GOOD, pole=None)])
