"""Which effects stay beside measured laws, and from which of them laws begin."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from support.made_fits import make_errors, make_fit

from pendulum_sysid import decisions
from pendulum_sysid.measuring import best_laws
from pendulum_sysid.measuring.best_laws import Starts, is_better, measure_from_starts

WINDOWS = 15
LAST = SimpleNamespace(fit=SimpleNamespace(choose=9.0, effects=()))
CALM, WILD = np.full(WINDOWS, 1.0), np.where(np.arange(WINDOWS) % 2, 1.3, 0.8)


@pytest.mark.parametrize(
    ("simple", "rich", "with_names", "without"),
    [
        (3.0 * CALM, 3.0 * CALM, False, True),
        (3.0 * CALM, 3.01 * CALM, False, True),
        (3.0 * CALM, 3.0 * WILD, False, True),
        (3.0 * CALM, 4.0 * CALM, True, True),
        (4.0 * CALM, 3.0 * CALM, False, False),
    ],
    ids=["alike", "by little", "by chance", "surely", "worse"],
)
def test_names_stay_unless_whole_windows_run_better_without(simple, rich, with_names, without):
    """Effects that are no names go unless whole windows run better with them."""

    simple, rich = make_judged(simple), make_judged(rich, effects=("rail_tilt",))
    assert is_better(simple, rich, ["rail_tilt"]) is with_names
    assert is_better(simple, rich, []) is without


def make_judged(factors, is_at_noise=False, laws=1, effects=()):
    """Return stand-ins of laws: errors over whole windows, a number of laws, and effects."""
    whole = make_fit(make_errors(seed=1, windows=WINDOWS) * factors[:, None])
    return SimpleNamespace(
        is_at_noise=is_at_noise,
        over_whole_windows=whole,
        kinds=("law",) * laws,
        effects=effects,
    )


@pytest.mark.parametrize(
    ("simple", "laws", "rich", "more_laws", "is_simple"),
    [
        (CALM, 1, CALM, 1, True),
        (CALM, 2, CALM, 1, False),
        (1.01 * CALM, 1, CALM, 2, True),
        (5.0 * CALM, 5, CALM, 6, False),
        (CALM, 3, 5.0 * CALM, 1, True),
    ],
    ids=["alike", "fewer laws", "by little", "more laws, surely", "fewer laws, worse"],
)
def test_at_the_noise_whole_windows_decide_and_then_the_number_of_laws(
    simple, laws, rich, more_laws, is_simple
):
    """A fit with five laws came first: 1.34 over short windows, but 19.5 over whole windows.

    The fit with six laws, which held the laws of the rig, ended at 0.78.
    """
    simple, rich = make_judged(simple, True, laws), make_judged(rich, True, more_laws)
    for names in (["rail_tilt"], []):
        assert is_better(simple, rich, names) is is_simple


def test_at_the_noise_effects_that_take_each_other_back_count_as_laws():
    """A disc, a scale and an offset were as good as one law, and 43 floors off elsewhere."""
    three = ("eccentric_encoder", "angle_scale", "angle_offset")
    simple, rich = make_judged(CALM, True, 3), make_judged(CALM, True, 2, three)
    assert not is_better(simple, rich, [])
    assert is_better(simple, rich, [], three)
    assert not is_better(simple, make_judged(CALM, True, 2, ("rail_tilt",)), [], three)


def test_a_fit_at_the_noise_is_better_than_a_fit_above_the_noise():
    above, at_noise = make_judged(0.5 * CALM), make_judged(CALM, True)
    assert is_better(at_noise, above, []) and not is_better(above, at_noise, [])


@pytest.mark.parametrize(
    ("first", "again", "is_taken"),
    [
        (None, 5.0, True),
        (None, None, False),
        (0.9, 0.8, False),
        (3.0, 1.0, False),
    ],
    ids=["no law", "no law again", "at the noise", "above the noise"],
)
def test_laws_begin_without_effects_that_may_be_there_where_no_law_helps(
    monkeypatch, first, again, is_taken
):
    """A limit, a spring and a load stood for four laws: 10 floors, and 2.2 without the three."""
    both, fewer = (
        SimpleNamespace(effects=effects) for effects in (("cogging", "rail_spring"), ("cogging",))
    )
    begun = []

    def measure(case, split, start, *about):
        begun.append(start)
        end = first if start is both else again
        if end is None:
            return None
        return make_judged(end * CALM, end <= decisions.MISFIT_AT_NOISE, 2, start.effects)

    monkeypatch.setattr(best_laws, "_measure_from", measure)
    monkeypatch.setattr(best_laws, "_is_ahead", lambda measured, last: True)
    starts = Starts((both,), ("cogging",), without_doubtful=fewer)
    measured = measure_from_starts(None, None, starts, LAST, lambda line: None)
    assert begun == ([both, fewer] if first is None else [both])
    if first is None and again is None:
        assert measured is None
    else:
        assert measured.effects == (fewer.effects if is_taken else both.effects)


@pytest.mark.parametrize(("first", "again"), [(3.0, 0.3), (0.3, None)], ids=["behind", "ahead"])
def test_a_start_that_was_given_up_is_measured_to_its_end_where_no_start_is_ahead(
    monkeypatch, first, again
):
    """Five effects left less than the first law beside one, and four laws left a tenth of it."""
    off = make_errors(1)
    bare, both = (SimpleNamespace(effects=effects) for effects in ((), ("rail_spring",)))
    last = SimpleNamespace(fit=replace(make_fit(off), effects=both.effects))
    limits = []

    def measure(case, split, start, last, report, most=np.inf):
        limits.append((start, most))
        factor = 3.0 if start is both else first if most < np.inf else again
        return SimpleNamespace(
            named=(make_fit(factor * off), ()), is_at_noise=False, kinds=("law",)
        )

    monkeypatch.setattr(best_laws, "_measure_from", measure)
    measured = measure_from_starts(None, None, Starts((bare, both), ()), last, lambda line: None)
    assert measured.named[0].choose < last.fit.choose
    most = last.fit.choose
    tried = [(bare, most), (both, most)]
    assert limits == (tried if again is None else [*tried, (bare, np.inf)])


def test_laws_begin_from_the_same_effects_once(monkeypatch):
    bare, both = (SimpleNamespace(effects=effects) for effects in ((), ("rail_spring",)))
    begun = []
    monkeypatch.setattr(best_laws, "_measure_from", lambda *about: begun.append(about[2]))
    starts = Starts((bare, both, both), (), without_doubtful=SimpleNamespace(effects=()))
    assert measure_from_starts(None, None, starts, LAST, lambda line: None) is None
    assert begun == [bare, both]
