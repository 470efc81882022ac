"""Windows and their three parts: inside stretches, apart, every regime in each."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid.cleaning.smooth_state import smooth_state
from pendulum_sysid.fitting.split import PATTERN, split_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows, gather, shorten_windows
from pendulum_sysid.records import Split
from pendulum_twin.errors import BadInputError
from pendulum_twin.signals import Signals

LENGTH = 100  # samples from start to end of a window


@pytest.fixture(scope="module")
def signals() -> Signals:
    return made(INTECO, 24.0).signals


def parts_of(signals: Signals) -> Split:
    return split_windows(signals, smooth_state(signals))


def names_by_begin(found: Split) -> list[str]:
    names = {
        int(b): name
        for name in ("train", "choose", "held_out")
        for b in getattr(found, name).begin
    }
    return [names[b] for b in sorted(names)]


@pytest.mark.parametrize("starts", [(0,), (0, 1), (0, 730), (0, 350, 399, 1201, 2310)])
@pytest.mark.parametrize("every_s", [0.25, 0.5, 1.0])
def test_windows_stay_inside_their_stretch(
    signals: Signals, starts: tuple[int, ...], every_s: float
) -> None:
    broken = replace(signals, stretch_begins=starts)
    windows = cut_windows(broken, smooth_state(broken), every_s)
    assert windows.samples == LENGTH + 1 and len(windows)
    for begin in windows.begin:
        assert any(s.start <= begin and begin + LENGTH < s.stop for s in broken.stretches)


def test_a_window_starts_from_the_smoothed_state(signals: Signals) -> None:
    state = smooth_state(signals)
    windows = cut_windows(signals, state, 0.5)
    assert np.array_equal(windows.start_states, state.states[windows.begin])
    assert np.array_equal(np.diff(windows.begin), np.full(len(windows) - 1, 50))


def test_windows_without_enough_samples_are_left_out(signals: Signals) -> None:
    valid = np.ones(len(signals), dtype=bool)
    valid[300:360] = (
        False  # more than half of the window from 3 s; the pole's samples are all there
    )
    windows = cut_windows(replace(signals, cart_valid=valid), smooth_state(signals), 1.0)
    assert 300 not in windows.begin and {200, 400} <= set(windows.begin.tolist())


def test_shorter_windows_hold_the_same_samples(signals: Signals) -> None:
    state = smooth_state(signals)
    windows = cut_windows(signals, state, 1.0)
    quarters = shorten_windows(state, windows, 4)
    assert len(quarters) == 4 * len(windows) and quarters.samples == LENGTH // 4 + 1
    assert np.array_equal(
        quarters.begin.reshape(-1, 4) - windows.begin[:, None],
        np.tile([0, 25, 50, 75], (len(windows), 1)),
    )
    assert np.array_equal(quarters.start_states, state.states[quarters.begin])


def test_what_is_gathered_is_what_was_measured(signals: Signals) -> None:
    valid = np.ones(len(signals), dtype=bool)
    valid[205] = False
    values, counts = gather(replace(signals, pole_valid=valid), np.array([200, 700]), 11)
    assert values.shape == counts.shape == (2, 11, 2)
    assert np.array_equal(values[1, :, 1], signals.pole[700:711])
    assert counts[0, 5].tolist() == [1.0, 0.0] and counts.sum() == 2 * 11 * 2 - 1


@pytest.mark.parametrize("starts", [(0,), (0, 550), (0, 401, 802, 1203)])
def test_the_parts_share_no_sample_but_the_ends_of_windows(
    signals: Signals, starts: tuple[int, ...]
) -> None:
    found = parts_of(replace(signals, stretch_begins=starts))
    used = np.zeros(len(signals), dtype=int)
    for part in (found.train, found.choose, found.held_out):
        for begin in part.begin:
            used[begin : begin + LENGTH] += 1
    assert used.max() == 1


def test_half_is_for_fitting_and_a_quarter_each_for_choosing_and_judging(signals: Signals) -> None:
    found = parts_of(signals)
    assert (len(found.train), len(found.choose), len(found.held_out)) == (12, 6, 5)
    assert names_by_begin(found)[:8] == [*PATTERN, *PATTERN]


def test_the_pattern_begins_one_place_further_on_in_every_stretch(signals: Signals) -> None:
    repeated = replace(
        signals, stretch_begins=tuple(range(0, 2400, 401))
    )  # four windows and no room for a fifth
    names = names_by_begin(parts_of(repeated))
    for stretch in range(5):
        assert names[4 * stretch : 4 * stretch + 4] == [
            PATTERN[(k + stretch) % 4] for k in range(4)
        ]


def test_a_recording_too_short_is_refused() -> None:
    with pytest.raises(
        BadInputError,
        match=r"^expected at least 4 usable windows of 1 s .*, found 3: record longer$",
    ):
        parts_of(made(INTECO, 4.0).signals)
    assert len(parts_of(made(INTECO, 4.01).signals).train) == 2
    assert WINDOW_S == 1.0


def test_a_part_that_stays_empty_is_refused() -> None:
    """Three windows and then one: the rotated pattern leaves none to judge on."""
    broken = replace(made(INTECO, 4.04).signals, stretch_begins=(0, 303))
    with pytest.raises(BadInputError, match="found one of these parts empty: record longer"):
        parts_of(broken)
