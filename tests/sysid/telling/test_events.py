"""What is missing in a few short stretches is told as events, and blames no place of the rig."""

from collections import namedtuple
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from support.made_recordings import (
    CART_NOISE_M,
    HANGING,
    INTECO,
    PERIOD_S,
    POLE_NOISE_RAD,
    sweep,
)

from pendulum_sysid import pipeline
from pendulum_sysid.fitting.noise_floor import NoiseFloor
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.records import Outcome, Recording
from pendulum_sysid.telling.events import Events, find_events, list_events
from pendulum_sysid.telling.outcome import Findings, decide_outcome
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

FLOOR = NoiseFloor(2.0, 2.0)
START = np.zeros(1)


def make_runs(errors: list[float]) -> WindowRuns:
    """Return runs of 1 s, one after another, with these errors in noise floors."""
    count = len(errors)
    measured = np.zeros((count, 11, 1))
    runs = measured + FLOOR.typical * np.array(errors)[:, None, None]
    return WindowRuns(
        (0,), np.arange(count) + 0.0, 0.1, measured, runs, np.ones_like(runs), np.ones(1)
    )


def test_a_few_windows_far_above_the_others_are_events() -> None:
    errors = [40.0] + 20 * [1.0]  # the first begins with its stretch, and is not asked
    errors[5], errors[6], errors[15] = 30.0, 12.0, 7.0
    events = find_events((make_runs(errors),), FLOOR, START)
    assert events is not None
    assert events.intervals_s == ((5.0, 7.0), (15.0, 16.0))
    assert "acts on the rig at 5 to 7 s and 15 to 16 s: a touch" in events.sentence
    assert "elsewhere the improved twin's error is 1 times its noise floor" in events.sentence


def test_windows_whose_times_round_apart_are_one_stretch() -> None:
    """9 of 59 seams between adjacent windows counted as apart: a stretch was told in pieces."""
    errors = 400 * [1.0]
    errors[10:69] = 59 * [30.0]
    runs = make_runs(errors)
    period_s = 0.0100012
    runs = replace(runs, begin_s=np.arange(400) * 10 * period_s, period_s=period_s)
    events = find_events((runs,), FLOOR, START)
    assert events is not None
    (interval,) = events.intervals_s
    assert interval == pytest.approx((100 * period_s, 690 * period_s))


def test_times_after_a_thousand_seconds_are_told_in_full() -> None:
    late = Events(((1010.25, 1011.3), (20000.0, 20001.0)), 1.0)
    assert "at 1010.2 to 1011.3 s and 20000 to 20001 s: a touch" in late.sentence


@pytest.mark.parametrize(
    "errors",
    [
        20 * [1.0],  # nothing is missing
        20 * [8.0],  # everywhere
        [1.0, 30.0] * 10,  # in every other window: a law
        [*(18 * [4.0]), 60.0, 4.0],  # the rest is not at the noise
        [1.0] + 12 * [1.0, 1.0, 1.0, 1.0, 30.0],  # twelve times
    ],
)
def test_errors_that_come_again_and_again_are_no_events(errors: list[float]) -> None:
    assert find_events((make_runs(errors),), FLOOR, START) is None


def test_held_out_runs_that_are_all_far_off_are_no_events() -> None:
    learned, held_out = make_runs(21 * [1.0]), make_runs([1.0, 30.0, 30.0])
    assert find_events((learned, held_out), FLOOR, START) is None


def test_without_a_window_inside_a_stretch_there_are_no_events() -> None:
    assert find_events((make_runs([1.0, 50.0]),), FLOOR, np.array([0.0, 1.0])) is None


@pytest.mark.parametrize(
    ("misfit", "base", "told"),
    [(1.1, 1.0, False), (4.0, 1.0, True), (4.0, 8.0, False)],
    ids=["by starts alone", "at a touch", "beside an effect that may be there"],
)
def test_what_starts_or_possible_effects_explain_is_no_event(
    misfit: float, base: float, told: bool
) -> None:
    """A controller near upright: two rigs of ten that hid nothing were said to be touched.

    A motor that weakened, and had no name, was said to be touched where the rest was largest.
    """
    errors = 21 * [1.0]
    errors[5] = 30.0
    every = np.ones(2100, dtype=bool)
    signals = Signals(PERIOD_S, np.zeros(2100), np.zeros(2100), None, every, every)
    blank = dict.fromkeys(Findings.__dataclass_fields__)
    findings = Findings(
        **{
            **blank,
            "case": namedtuple("case", "signals")(signals),
            "base": namedtuple("fit", "effects")(()),
            "best": namedtuple("fit", "choose effects")(0.9, ("gain_drift",)),
            "named": (),
            "laws": (),
            "floor": FLOOR,
            "after": {"learn": make_runs(errors), "held_out": make_runs(errors)},
            "learned_misfit": 1.0,
            "held_out_misfit": misfit,
            "base_runs": make_runs([base * error for error in errors]),
        }
    )
    assert (list_events(findings) is not None) == told


def strike(at_s: tuple[float, ...], seconds: float) -> Recording:
    """Make a recording of INTECO's twin whose pole is struck: its rate jumps by 4 rad/s."""
    command = sweep(seconds, 0.1)
    n, zero = len(command), np.zeros(1, dtype=np.int64)
    states, state = np.empty((n, 4)), HANGING
    edges = [0, *(round(t / PERIOD_S) for t in at_s), n]
    for first, stop in pairwise(edges):
        length = stop - first + 1
        signals = Signals(
            PERIOD_S,
            np.append(command[first:stop], 0.0),
            *(np.zeros(length) for _ in range(2)),
            *(np.ones(length, dtype=bool) for _ in range(2)),
        )
        run = run_freely(signals, make_theta(INTECO)[None], zero, zero, state[None], length)[0]
        states[first:stop], state = run[:-1], run[-1] + [0.0, 0.0, 0.0, 4.0]
    rng = np.random.default_rng(0)
    cart = states[:, 0] + rng.normal(0.0, CART_NOISE_M, n)
    pole = states[:, 1] + rng.normal(0.0, POLE_NOISE_RAD, n)
    every = np.ones(n, dtype=bool)
    return Recording("struck", "sha256:0", Signals(PERIOD_S, command, cart, pole, every, every))


@pytest.mark.long
@pytest.mark.parametrize(
    ("at_s", "seconds", "says"), [(11.3, 20.0, "11 to 12 s"), (29.3, 40.0, "29 to 30 s")]
)
def test_a_pole_that_was_struck_is_said_to_have_been_touched(
    at_s: float, seconds: float, says: str
) -> None:
    """In a held-out window, and in one that chooses: physics was missing at the cart."""
    verdict = pipeline.diagnose([strike((at_s,), seconds)], INTECO, lambda line: None)
    assert verdict.outcome is Outcome.NOT_IN_CATALOGUE
    assert verdict.missing_physics == ()
    assert f"acts on the rig at {says}: a touch" in verdict.sentence
    assert verdict.location is not None and verdict.location.intervals_s == verdict.events_s
    assert not verdict.unlike_rig


@pytest.mark.parametrize(
    ("remains", "outcome"), [(1.05, Outcome.NOTHING_MISSING), (9.0, Outcome.NOT_IN_CATALOGUE)]
)
def test_an_effect_that_few_parts_show_again_leaves_its_errors_unexplained(
    remains: float, outcome: Outcome
) -> None:
    """Two runs of two rigs in a file: a drift of the gain, 1 part of 3, stood for all errors."""
    blank: dict[str, Any] = dict.fromkeys(Findings.__dataclass_fields__)
    fit = namedtuple("fit", "choose")
    blank |= {"named": (), "wrong_shapes": (), "learned_misfit": 1.0}
    findings = Findings(**{**blank, "base": fit(50.0), "best": fit(remains)})
    assert decide_outcome(findings) is outcome
