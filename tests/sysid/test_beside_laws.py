"""Rules of names beside measured laws."""

from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest

from pendulum_sysid import beside_laws
from pendulum_sysid.beside_laws import (
    add_laws,
    ask_names_again,
    ask_shapes_again,
    find_explaining,
    list_doubtful_sizes,
)
from pendulum_sysid.finding import naming
from pendulum_sysid.finding.environments import Steadiness
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.localisation.shape_check import WrongShape
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.finding.replication import Replication
from pendulum_sysid.records import Estimate
from pendulum_sysid.telling.outcome import Findings
from pendulum_twin.effects.effect import Scale

OFFSET = WrongShape("angle_offset", 0.04, "pole_rate*pole_angle", "pole")
FRICTION = WrongShape("cart_coulomb_friction", 0.1, "pole_angle", "cart")
DISC = WrongShape("eccentric_encoder", 0.1, "pole_angle", "sensor")
CART_LAW, TURN_LAW = ("cart_drag_by_pole_rate",), ("angle_error_over_turn",)
RAIL_LAW = ("position_error_along_rail",)


@pytest.mark.parametrize(
    ("before", "beside", "laws", "is_needed", "steady", "stands"),
    [
        (OFFSET, None, CART_LAW, False, False, False),
        (OFFSET, OFFSET, CART_LAW, True, True, True),
        (FRICTION, None, CART_LAW, False, True, True),
        (FRICTION, None, CART_LAW, True, False, True),
        (FRICTION, None, CART_LAW, True, True, False),
        (FRICTION, None, (), False, False, False),
        (DISC, None, TURN_LAW, False, False, False),
        (DISC, None, RAIL_LAW, False, False, True),
    ],
    ids=[
        "elsewhere", "still seen", "at its place", "not steady", "needed and steady", "no law",
        "leaves it parts", "of its place",
    ],
)  # fmt: skip
def test_a_law_takes_a_wrong_shape_away_elsewhere_or_from_what_the_twin_needs(
    monkeypatch: pytest.MonkeyPatch,
    before: WrongShape,
    beside: WrongShape | None,
    laws: tuple[str, ...],
    is_needed: bool,
    steady: bool,
    stands: bool,
) -> None:
    needed = (before.effect,) if is_needed else ()
    monkeypatch.setattr(beside_laws, "measure_remainders", lambda *about: [])
    monkeypatch.setattr(
        beside_laws, "find_wrong_shapes", lambda *about: [beside] if beside else []
    )
    named = (SimpleNamespace(effect=before.effect, is_steady=steady),)
    findings = SimpleNamespace(case=None, base=None, wrong_shapes=(before,), named=named)
    fit = SimpleNamespace(theta=np.zeros(1))
    shapes = ask_shapes_again(findings, fit, named, needed, laws)
    assert shapes == ((before,) if stands else ())


@pytest.mark.parametrize(
    ("laws", "at_noise", "doubtful"),
    [(CART_LAW, True, ["shared"]), (CART_LAW, False, ["shared", "other"]),
     ((*CART_LAW, *TURN_LAW), True, ["shared", "other"])],
    ids=["an explanation", "leaves errors", "a choice among laws"],
)  # fmt: skip
def test_one_law_that_explains_all_errors_leaves_in_doubt_what_it_can_hold(
    monkeypatch: pytest.MonkeyPatch, laws: tuple[str, ...], at_noise: bool, doubtful: list[str]
) -> None:
    monkeypatch.setattr(beside_laws, "list_shared_parameters", lambda case, law_fit: ("shared",))
    fit = SimpleNamespace(estimates={"shared": None, "other": None})
    measured = SimpleNamespace(case=None, law_fit=None, kinds=laws, named=(fit, ()))
    assert list(list_doubtful_sizes(measured, at_noise)) == doubtful


def test_the_shape_of_a_name_that_laws_made_is_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(beside_laws, "measure_remainders", lambda *about: [])
    monkeypatch.setattr(beside_laws, "find_wrong_shapes", lambda *about: [FRICTION])
    findings = SimpleNamespace(case=None, base=None, wrong_shapes=(), named=())
    fit = SimpleNamespace(theta=np.zeros(1))
    named = (SimpleNamespace(effect=FRICTION.effect, is_steady=True),)
    assert ask_shapes_again(findings, fit, named, (), ()) == (FRICTION,)


def make_named(weight: float = 1.0, shown: int = 3) -> Named:
    return Named(
        "friction_warming",
        Lead(2.0, 5.0),
        replication=Replication(shown, 3),
        weight=weight,
        is_sure=False,
    )


@dataclass(frozen=True)
class CaseStandIn:
    twin: None = None
    scales: dict[Scale, float] = field(default_factory=lambda: dict.fromkeys(Scale, 1.0))


@dataclass(frozen=True)
class FitStandIn:
    effects: tuple[str, ...]
    estimates: dict[str, Estimate]
    theta: None = None
    twin: None = None
    choose: float = 2.0


def stand_in_for_laws(monkeypatch: pytest.MonkeyPatch, **answers: object) -> None:
    """Let effects beside laws be as given: all of them are needed, and nothing doubts them."""
    usual: dict[str, object] = {
        "list_sized": lambda measured, names: list(names),
        "leave_out_names": lambda measured, sized: dict.fromkeys(sized),
        "list_needed": lambda measured, without: tuple(without),
        "list_stand_ins": lambda measured, without: [],
        "list_lesser_parts": lambda measured, names: [],
        "list_bent": lambda measured, names: [],
        "list_cancelled": lambda case, fit: frozenset(),
        "ask_rivals_again": lambda measured, named: tuple(named),
        "measure_steadiness": lambda *about: {},
        "list_explaining": lambda *about: {},
    }
    for name, answer in {**usual, **answers}.items():
        monkeypatch.setattr(beside_laws, name, answer)


@pytest.mark.parametrize(
    ("doubted", "needed", "shares", "sure", "part", "explains", "regained"),
    [
        (make_named(), True, 1.0, True, False, False, True),
        (make_named(weight=0.5), True, 1.0, True, False, False, False),
        (make_named(weight=0.5), True, 1.0, True, False, True, True),
        (make_named(shown=1), True, 1.0, True, False, False, False),
        (make_named(shown=1), True, 1.0, True, False, True, True),
        (make_named(), False, 1.0, True, False, False, False),
        (make_named(), True, 0.4, True, False, False, False),
        (make_named(), True, 1.0, False, False, True, False),
        (make_named(), True, 1.0, True, True, True, False),
    ],
    ids=[
        "all",
        "not believed",
        "not believed and explains most",
        "not again",
        "not again and explains most",
        "not needed",
        "not steady",
        "no size",
        "of a law",
    ],
)
def test_an_effect_that_laws_make_sure_is_a_name(
    monkeypatch: pytest.MonkeyPatch,
    doubted: Named,
    needed: bool,
    shares: float,
    sure: bool,
    part: bool,
    explains: bool,
    regained: bool,
) -> None:
    name = doubted.effect
    steadiness = Steadiness(np.full(6, shares), np.full(6, 0.02))
    stand_in_for_laws(
        monkeypatch,
        is_part_of_law=lambda measured, name: part,
        list_needed=lambda measured, without: tuple(without) * needed,
    )
    monkeypatch.setattr(naming, "is_surely_there", lambda *about: sure)
    findings = SimpleNamespace(case=SimpleNamespace(scales={}), named=(), perhaps=(doubted,))
    fit = SimpleNamespace(effects=(name,), twin=None, choose=2.0)
    measured = SimpleNamespace()
    explaining = {name: None} if explains else {}
    names, perhaps, _ = ask_names_again(findings, measured, fit, {name: steadiness}, explaining)
    assert [effect.effect for effect in names] == [name] * regained
    assert [effect.effect for effect in perhaps] == [name] * (not regained)
    assert all(effect.is_sure for effect in names)


@pytest.mark.parametrize(
    ("doubted", "shares", "part", "asked"),
    [
        (make_named(weight=0.1, shown=0), 1.0, False, True),
        (make_named(), 0.4, False, False),
        (make_named(), 1.0, True, False),
        (replace(make_named(), effect="coarse_command"), 0.4, False, True),
        (replace(make_named(weight=0.1), effect="coarse_command"), 1.0, False, False),
        (replace(make_named(), effect="encoder_slip"), 1.0, False, False),
        (replace(make_named(), is_rounding=True), 1.0, False, False),
    ],
    ids=[
        "steady",
        "not steady",
        "of a law",
        "no size",
        "unbelieved",
        "of an instant",
        "rounding",
    ],
)
def test_effects_that_are_the_same_everywhere_are_asked_what_they_explain(
    monkeypatch: pytest.MonkeyPatch, doubted: Named, shares: float, part: bool, asked: bool
) -> None:
    stand_in_for_laws(
        monkeypatch,
        is_part_of_law=lambda measured, name: part,
        list_explaining=lambda measured, fit, names: dict.fromkeys(names),
    )
    steadiness = Steadiness(np.full(6, shares), np.full(6, 0.02))
    findings = SimpleNamespace(perhaps=(doubted,))
    explaining = find_explaining(findings, None, None, {"friction_warming": steadiness})
    assert list(explaining) == [doubted.effect] * asked


def test_an_effect_without_a_size_that_explains_most_is_a_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    step = replace(make_named(), effect="coarse_command", is_sure=True, lacks_size=True)
    stand_in_for_laws(monkeypatch, is_part_of_law=lambda measured, name: False)
    monkeypatch.setattr(naming, "is_surely_there", lambda *about: True)
    findings = SimpleNamespace(case=SimpleNamespace(scales={}), named=(), perhaps=(step,))
    fit = SimpleNamespace(effects=(step.effect,), twin=None, choose=2.0)
    names, perhaps, needed = ask_names_again(findings, SimpleNamespace(), fit, {}, {})
    assert (names, perhaps, needed) == ((), (step,), (step.effect,))
    explaining = {step.effect: None}
    names, perhaps, _ = ask_names_again(findings, SimpleNamespace(), fit, {}, explaining)
    assert [effect.effect for effect in names] == [step.effect] and not perhaps
    assert all(effect.is_lasting for effect in names)


def run_at(score: float) -> dict[str, object]:
    """Return stand-ins for free runs with a score."""
    return {"train": None, "held_out": SimpleNamespace(score=score)}


def measure_beside(
    monkeypatch: pytest.MonkeyPatch,
    laws: tuple[str, ...],
    is_unlike: bool = False,
    score: float = 1.0,
    is_behind: bool = False,
) -> tuple[Findings, Findings]:
    """Return findings with a tilt that is sure beside these laws alone, before and after.

    score: of the twin with laws; without laws it is 2.
    is_behind: whether the twin with laws surely runs held-out windows worse than the given twin.
    """
    tilt, size = "rail_tilt", "rail_tilt.angle_rad"
    law_fit = FitStandIn((tilt,), {size: Estimate(0.004, 0.003, 0.005)})
    without = FitStandIn((tilt,), {size: Estimate(0.004, -0.001, 0.009)})
    measured = SimpleNamespace(named=(law_fit, ()), kinds=laws, case=None, law_fit=None)
    measured.law_fit = SimpleNamespace(curves=laws)
    stand_in_for_laws(
        monkeypatch,
        measure_noise_floor=lambda *about: None,
        measure_whole_windows=lambda *about: (1.0, 1.0),
        widen_bands=lambda measured: measured.named[1],
        widen_intervals=lambda case, split, fit: fit,
        is_at_noise=lambda *about: True,
        list_shared_parameters=lambda case, law_fit: (),
        ask_shapes_again=lambda *about: (),
        add_readings=lambda case, fit, sure: (fit, sure),
        run_parts=lambda case, split: run_at(score),
        inspect_twin=lambda *about: [],
        localise=lambda *about: None,
        is_unlike=lambda findings: is_unlike,
        is_surely_behind=lambda improved, given: is_behind,
    )
    names = (Named(tilt, Lead(2.0, 5.0)),)
    findings = Findings(CaseStandIn(), without, without, names, *[None] * 6)
    findings = replace(findings, before=run_at(3.0), after=run_at(2.0))
    kept = add_laws(findings, SimpleNamespace(held_out=None), measured)
    return findings, kept


@pytest.mark.parametrize(
    ("laws", "named"), [(CART_LAW, True), ((*CART_LAW, *TURN_LAW), False)], ids=["one", "several"]
)
def test_a_name_is_judged_by_the_interval_that_the_verdict_tells(
    monkeypatch: pytest.MonkeyPatch, laws: tuple[str, ...], named: bool
) -> None:
    """Several laws are a choice: a name that is sure beside them alone is none."""
    _, kept = measure_beside(monkeypatch, laws)
    assert [effect.effect for effect in kept.named] == ["rail_tilt"] * named
    assert [effect.effect for effect in kept.perhaps] == ["rail_tilt"] * (not named)


@pytest.mark.parametrize(("score", "goes"), [(2.1, True), (1.5, True), (0.1, False)])
def test_laws_that_leave_a_recording_unlike_its_rig_go(
    monkeypatch: pytest.MonkeyPatch, score: float, goes: bool
) -> None:
    """Of a draught three laws were measured, and the twin followed 45 % of the motion.

    Laws that explain most of the error stay.
    """
    findings, kept = measure_beside(monkeypatch, CART_LAW, is_unlike=True, score=score)
    assert (kept is findings) is goes


def test_laws_with_which_a_twin_is_behind_the_given_twin_go(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    findings, kept = measure_beside(monkeypatch, CART_LAW, is_behind=True)
    assert kept is findings


@pytest.mark.parametrize("doubt", ["list_lesser_parts", "list_stand_ins"])
def test_an_effect_that_is_less_than_a_law_or_stands_for_it_is_no_name(
    monkeypatch: pytest.MonkeyPatch, doubt: str
) -> None:
    wave, friction = (
        Named("eccentric_encoder", Lead(2, 5)),
        Named("cart_coulomb_friction", Lead(2, 5)),
    )
    stand_in_for_laws(monkeypatch, **{doubt: lambda measured, names: [wave.effect]})
    monkeypatch.setattr(naming, "is_surely_there", lambda *about: True)
    findings = SimpleNamespace(case=SimpleNamespace(scales={}), named=(wave, friction), perhaps=())
    fit = SimpleNamespace(effects=(wave.effect, friction.effect), choose=2.0)
    measured = SimpleNamespace(kinds=("angle_error_over_turn",))
    names, perhaps, _ = ask_names_again(findings, measured, fit, {}, {})
    assert (names, perhaps) == ((friction,), (wave,))
    measured = SimpleNamespace(kinds=("cart_dry_friction_by_velocity",))
    stand_in_for_laws(monkeypatch)
    names, perhaps, _ = ask_names_again(findings, measured, fit, {}, {})
    assert names == (wave, friction)


@pytest.mark.parametrize("bent", [True, False])
def test_an_effect_whose_shape_a_law_bends_is_no_name(
    monkeypatch: pytest.MonkeyPatch, bent: bool
) -> None:
    zone = Named("input_dead_zone", Lead(2, 5))
    stand_in_for_laws(monkeypatch, list_bent=lambda measured, names: list(names) * bent)
    monkeypatch.setattr(naming, "is_surely_there", lambda *about: True)
    findings = SimpleNamespace(case=SimpleNamespace(scales={}), named=(zone,), perhaps=())
    fit = SimpleNamespace(effects=(zone.effect,), choose=2.0)
    names, perhaps, _ = ask_names_again(findings, SimpleNamespace(), fit, {}, {})
    assert names == (zone,) * (not bent) and perhaps == (zone,) * bent
