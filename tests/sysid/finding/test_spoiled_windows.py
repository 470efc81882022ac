"""A few windows that wrong commands have spoiled do not bend the search over the long horizon."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_fits import make_errors, make_fit
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.finding import search as search_module
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.search import Explanation, extend_horizon
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.finding.spoiled_windows import find_spoiled, leave_windows_out, pick_windows
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Fit

WRONG = 0.01  # by which eight logged commands are too large, of full PWM


def search_spoiled(which: int) -> tuple[Search, int]:
    """Return the search of a recording whose log is wrong in a window, and the wrong sample."""
    recording = made(INTECO, 30.0, 0.2)
    prepared = prepare([recording], INTECO)
    at = int(prepared.split.learn.begin[which]) + 20
    command = recording.signals.command.copy()
    command[at : at + 8] += WRONG
    wrong = replace(recording, signals=replace(recording.signals, command=command))
    prepared = prepare([wrong], INTECO)
    return Search(prepared.case, prepared.split), at


def test_the_search_over_the_long_horizon_leaves_a_spoiled_window_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search, at = search_spoiled(9)
    base = fit_parameters_alone(search)
    begun = search.fit_over_horizon(base, 1)
    spoiled = find_spoiled(begun)
    begins = search.split.learn.begin
    assert begun.choose > decisions.MISFIT_AT_NOISE and spoiled.sum() in (1, 2)
    assert all(begin <= at < begin + 101 for begin in begins[spoiled])

    asked: list[tuple[Search, Fit]] = []

    def grow(search: Search, fit: Fit) -> Fit:
        asked.append((search, fit))
        return fit

    monkeypatch.setattr(search_module, "grow_set", grow)
    monkeypatch.setattr(search_module, "prune_set", lambda search, kept, fit, expected=(): fit)
    whole = extend_horizon(search, base, Explanation(base, None)).fit
    ((rest, calm),) = asked
    assert calm.choose < 1.2 and len(calm.window_squares) == len(begins) - spoiled.sum()
    assert np.array_equal(rest.split.learn.begin, begins[~spoiled])
    assert np.array_equal(rest.split.held_out.begin, search.split.held_out.begin)
    assert len(whole.window_squares) == len(begins) and whole.pieces == 1


def test_windows_far_off_are_spoiled_only_where_they_are_few() -> None:
    errors = make_errors(0, windows=40).clip(1.0, 6.0)
    assert not find_spoiled(make_fit(errors)).any()
    few, many = errors.copy(), errors.copy()
    few[[3, 17]] = 100.0
    many[: decisions.MOST_EVENTS + 1] = 100.0
    assert list(np.flatnonzero(find_spoiled(make_fit(few)))) == [3, 17]
    assert not find_spoiled(make_fit(many)).any()
    short = make_errors(0, windows=8).clip(1.0, 6.0)
    short[:3] = 100.0  # three of eight
    assert not find_spoiled(make_fit(short)).any()


def test_a_fit_keeps_the_pieces_of_the_windows_that_stay() -> None:
    search, _ = search_spoiled(9)
    base = fit_parameters_alone(search)
    kept = np.arange(len(search.split.learn)) % 3 > 0
    picked = pick_windows(base, kept)
    rows = np.repeat(kept, base.pieces)
    assert np.array_equal(picked.start_states, base.start_states[rows])
    assert np.array_equal(picked.window_squares, base.window_squares[rows])
    rest = leave_windows_out(search, ~kept)
    assert len(rest.split.learn) * base.pieces == len(picked.counts)
