"""Whether anything remains is one rule, and how much is one measure, before and after."""

from collections import namedtuple
from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support.drawn_verdicts import make_named
from support.made_recordings import (
    CART_NOISE_M,
    HANGING,
    INTECO,
    PERIOD_S,
    POLE_NOISE_RAD,
    made,
    sweep,
)

from pendulum_sysid import pipeline
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.localisation.shape_check import WrongShape
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.fitting.noise_floor import NoiseFloor
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.measuring.repeatability import Repeatability
from pendulum_sysid.records import Outcome, Recording
from pendulum_sysid.telling.light import AMBER, BLUE, judge_light
from pendulum_sysid.telling.likeness import compute_floors
from pendulum_sysid.telling.outcome import (
    Findings,
    compute_random_share,
    list_told,
    runs_at_noise,
)
from pendulum_sysid.telling.sentences import describe_size
from pendulum_sysid.verdict.record import Verdict
from pendulum_sysid.verdict.scores import Remainder
from pendulum_twin.free_runs import run_freely
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

FLOOR = NoiseFloor(3.0, 2.0)
Fit = namedtuple("Fit", "choose")


def make_runs(errors: list[float]) -> WindowRuns:
    """Return runs of 1 s that follow a wave with these errors, in units of the sensor's noise."""
    count = len(errors)
    measured = np.tile(1e3 * np.sin(np.arange(11.0)), (count, 1))[..., None]
    runs = measured + np.array(errors)[:, None, None]
    return WindowRuns(
        (0,), np.arange(count) + 0.0, 0.1, measured, runs, np.ones_like(runs), np.ones(1)
    )


def make_findings(before: list[float], after: list[float], **others: Any) -> Findings:
    """Return findings with these errors of held-out windows, in units of the sensor's noise."""
    runs = {"before": make_runs(before), "after": make_runs(after)}
    blank: dict[str, Any] = dict.fromkeys(Findings.__dataclass_fields__)
    parts = {when: {"held_out": part} for when, part in runs.items()}
    defaults = {"best": Fit(1.0), "floor": FLOOR, "laws": (), "named": ("an effect",)}
    misfits = {"learned_misfit": 1.0, "held_out_misfit": 1.0}
    return Findings(**{**blank, **defaults, **misfits, **parts, **others})


@pytest.mark.parametrize(
    ("others", "nothing"),
    [
        ({}, True),
        ({"best": Fit(2.0)}, False),
        ({"learned_misfit": 3.3}, False),
        ({"held_out_misfit": 2.5}, False),
        ({"learned_misfit": 3.3, "law_misfits": (1.1, 0.9), "with_laws": Fit(1.0)}, True),
        ({"law_misfits": (1.1, 1.9), "with_laws": Fit(1.0)}, False),
    ],
)
def test_nothing_remains_where_pieces_and_whole_windows_run_at_the_noise(
    others: dict[str, Any], nothing: bool
) -> None:
    assert runs_at_noise(make_findings([2.0], [2.0], **others)) == nothing


@pytest.mark.parametrize(
    ("others", "before", "after"),
    [
        ({}, 10.0, 2.0),  # the median window
        ({"learned_misfit": 9.0}, 10.0, 2.0),  # which shows it
        ({"floor": NoiseFloor(9.0, 4.0)}, 5.0, 1.0),
        ({"floor": NoiseFloor(9.0, 4.0), "held_out_misfit": 9.0}, 5.0, 1.0),  # of whole windows
    ],
)
def test_before_and_after_have_one_measure(
    others: dict[str, Any], before: float, after: float
) -> None:
    floors = compute_floors(make_findings([20.0, 20.0, 99.0], [4.0, 4.0, 80.0], **others))
    assert (floors.before, floors.after) == pytest.approx((before, after))


@pytest.mark.parametrize(
    ("floor", "ratio"), [(NoiseFloor(4.0, 2.0), 7.0), (NoiseFloor(2.0, 4.0), 7.0)]
)
def test_of_an_error_that_nothing_explains_the_larger_figure_counts(
    floor: NoiseFloor, ratio: float
) -> None:
    """The median window's, or that of all windows together."""
    nothing = {"named": (), "perhaps": (), "certain": (), "learned_misfit": 9.0}
    findings = make_findings(9 * [28.0], 9 * [14.0], floor=floor, **nothing)
    floors = compute_floors(findings)
    assert (floors.before, floors.after) == pytest.approx((2 * ratio, ratio))


@pytest.mark.parametrize(("again", "random"), [(0.8, 0.2), (0.1, 0.7), (None, 0.7)])
def test_what_comes_again_is_not_random(again: float | None, random: float) -> None:
    """Nor is what depends on something that was asked: here 0.3 of it."""
    repeats = None if again is None else Repeatability(again, again, again, 9, 1.0)
    remains = SimpleNamespace(explained=0.3)
    findings = make_findings([2.0], [2.0], repeats=repeats, remains=remains)
    assert compute_random_share(findings) == pytest.approx(random)


@pytest.mark.parametrize(("ratio", "is_told"), [(1.4, False), (1.6, True)])
def test_beside_a_wrong_shape_a_name_of_another_place_is_told_if_most_of_its_error_is_its_own(
    ratio: float, is_told: bool
) -> None:
    wrong = WrongShape("pole_quadratic_drag", 0.3, "the pole's rate", "pole")
    drag, tilt = Named(wrong.effect, Lead(9.0, 9.0)), Named("rail_tilt", Lead(ratio, 9.0))
    findings = make_findings(
        [2.0],
        [2.0],
        base=Fit(9.0),
        named=(drag, tilt),
        wrong_shapes=(wrong,),
        certain=(),
        needed=(),
    )
    assert list_told(findings) == ((tilt,) if is_told else ())


def test_a_twin_that_has_not_changed_has_not_become_worse() -> None:
    """A pole that was struck once: '2.23 to 39.2 noise floors, 17.6 times larger'."""
    errors = 14 * [4.0] + [400.0]
    nothing = {"named": (), "perhaps": (), "certain": (), "held_out_misfit": 30.0}
    floors = compute_floors(make_findings(errors, errors, **nothing))
    assert floors.before == floors.after > 30.0
    better = compute_floors(make_findings(15 * [1.4], 15 * [1.2]))
    assert (better.before, better.after) == (1.0, 1.0)  # a chance below a perfect model


def change_gain(by: float, seconds: float = 30.0, at_s: float = 20.0) -> Recording:
    """Make a recording of INTECO's twin whose force per command steps by a share."""
    command, k = sweep(seconds, 0.1), round(at_s / PERIOD_S)
    n, zero = len(command), np.zeros(1, dtype=np.int64)
    states, state = np.empty((n, 4)), HANGING
    for (first, stop), gain in zip(pairwise((0, k, n)), (1.0, 1.0 + by), strict=True):
        length = stop - first + 1
        blank, every = np.zeros(length), np.ones(length, dtype=bool)
        signals = Signals(
            PERIOD_S, np.append(command[first:stop], 0.0), blank, blank, every, every
        )
        rig = replace(INTECO.rig, force_per_pwm_n=(INTECO.rig.force_per_pwm_n or 0.0) * gain)
        theta = make_theta(replace(INTECO, rig=rig))
        run = run_freely(signals, theta[None], zero, zero, state[None], length)[0]
        states[first:stop], state = run[:-1], run[-1]
    rng, every = np.random.default_rng(1), np.ones(n, dtype=bool)
    cart = states[:, 0] + rng.normal(0.0, CART_NOISE_M, n)
    pole = states[:, 1] + rng.normal(0.0, POLE_NOISE_RAD, n)
    return Recording("step", "sha256:0", Signals(PERIOD_S, command, cart, pole, every, every))


def diagnose(recording: Recording) -> Verdict:
    return pipeline.diagnose([recording], INTECO, lambda line: None)


@pytest.mark.long
def test_what_whole_windows_show_remains() -> None:
    """A gain that steps by a tenth has no name, and the twin is used with care."""
    verdict = diagnose(change_gain(0.1))
    assert verdict.outcome is Outcome.NOT_IN_CATALOGUE and verdict.fit is not None
    assert verdict.fit.floors is not None and verdict.remainder is not None
    assert verdict.remainder.above_noise_floor == verdict.fit.floors.after > 1.5
    assert verdict.remainder.whole_windows is not None and verdict.remainder.whole_windows > 1.5
    assert "times the noise floor" in verdict.sentence and "may be random" not in verdict.sentence
    light = judge_light(verdict)
    assert light.colour == AMBER and "over whole windows" in light.reasons[0]


@pytest.mark.parametrize(
    ("error", "said"),
    [(2.6, "6.15 times the sensors' noise over whole windows"), (4.0, "2 times the noise floor")],
)
def test_the_scale_that_shows_an_error_is_said(error: float, said: str) -> None:
    findings = make_findings(9 * [50.0], 9 * [error], learned_misfit=6.15)
    assert describe_size(findings).startswith(said)


def test_a_twin_that_errs_over_whole_windows_is_used_with_care() -> None:
    for whole, colour in ((2.9, BLUE), (3.1, AMBER), (None, BLUE)):
        rest = Remainder("drive", 1.4, "depends on nothing", whole_windows=whole)
        assert judge_light(replace(make_named(), remainder=rest)).colour == colour


def test_a_better_twin_never_has_the_larger_figure() -> None:
    """At the noise of the median window the figure went from 1.5 to that of whole windows, 6."""
    figures = [
        compute_floors(make_findings(9 * [50.0], 9 * [error], held_out_misfit=6.0 + error)).after
        for error in (4.0, 3.1, 2.9, 2.5)
    ]
    assert figures == sorted(figures, reverse=True)


def test_nothing_remains_of_a_rig_that_hides_nothing() -> None:
    verdict = diagnose(made(INTECO, 20.0))
    assert verdict.outcome is Outcome.NOTHING_MISSING and verdict.remainder is None
    assert "What remains" not in verdict.sentence and judge_light(verdict).colour == BLUE
    assert verdict.fit is not None and verdict.fit.floors is not None
    far = replace(verdict.fit, floors=replace(verdict.fit.floors, after=3.1))
    assert judge_light(replace(verdict, fit=far)).colour == AMBER  # whatever remains
