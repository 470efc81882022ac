"""Rules of the pipeline between the search's answer and the verdict."""

from types import SimpleNamespace

import numpy as np
import pytest

from pendulum_sysid import pipeline
from pendulum_sysid.finding import naming
from pendulum_sysid.finding.environments import Steadiness
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.localisation.shape_check import Misfit
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.finding.replication import Replication
from pendulum_sysid.pipeline import ask_names_again, ask_shapes_again
from pendulum_twin.laws.law import Law

OFFSET = Misfit("angle_offset", 0.04, "pole_rate*pole_angle", "pole")
FRICTION = Misfit("cart_coulomb_friction", 0.1, "pole_angle", "cart")
CART_LAW = {"cart_drag_by_pole_rate": Law((0.0, 1.0), (0.1, 0.2))}


@pytest.mark.parametrize(
    ("before", "beside", "laws", "stands"),
    [
        (OFFSET, None, CART_LAW, False),
        (OFFSET, OFFSET, CART_LAW, True),
        (FRICTION, None, CART_LAW, True),
        (FRICTION, None, {}, False),
    ],
    ids=["a law elsewhere", "still seen", "a law at its place", "no law"],
)
def test_a_wrong_shape_is_taken_away_by_laws_at_other_places_alone(
    monkeypatch: pytest.MonkeyPatch,
    before: Misfit,
    beside: Misfit | None,
    laws: dict[str, Law],
    stands: bool,
) -> None:
    monkeypatch.setattr(pipeline, "measure_remainders", lambda *about: [])
    monkeypatch.setattr(pipeline, "find_misfits", lambda *about: [beside] if beside else [])
    findings = SimpleNamespace(case=None, base=None, misfits=(before,))
    fit = SimpleNamespace(theta=np.zeros(1), twin=SimpleNamespace(measured_laws=laws))
    assert ask_shapes_again(findings, fit, [before.effect]) == ((before,) if stands else ())


def make_named(weight: float = 1.0, shown: int = 3) -> Named:
    return Named(
        "friction_warming",
        Lead(2.0, 5.0),
        replication=Replication(shown, 3),
        weight=weight,
        is_sure=False,
    )


@pytest.mark.parametrize(
    ("doubted", "needed", "shares", "sure", "part", "regained"),
    [
        (make_named(), True, 1.0, True, False, True),
        (make_named(weight=0.5), True, 1.0, True, False, False),
        (make_named(shown=1), True, 1.0, True, False, False),
        (make_named(), False, 1.0, True, False, False),
        (make_named(), True, 0.4, True, False, False),
        (make_named(), True, 1.0, False, False, False),
        (make_named(), True, 1.0, True, True, False),
    ],
    ids=["all", "not believed", "not again", "not needed", "not steady", "no size", "of a law"],
)
def test_an_effect_that_laws_make_sure_is_a_name(
    monkeypatch: pytest.MonkeyPatch,
    doubted: Named,
    needed: bool,
    shares: float,
    sure: bool,
    part: bool,
    regained: bool,
) -> None:
    name = doubted.effect
    steadiness = Steadiness(np.full(6, shares), np.full(6, 0.02))
    monkeypatch.setattr(pipeline, "list_sized", lambda measured, names: list(names))
    monkeypatch.setattr(pipeline, "is_part_of_law", lambda measured, name: part)
    monkeypatch.setattr(pipeline, "list_lesser_parts", lambda measured, names: [])
    monkeypatch.setattr(pipeline, "list_needed", lambda measured, sized: tuple(sized) * needed)
    monkeypatch.setattr(pipeline, "measure_steadiness", lambda *about: {name: steadiness})
    monkeypatch.setattr(naming, "is_surely_there", lambda *about: sure)
    findings = SimpleNamespace(case=SimpleNamespace(scales={}), named=(), perhaps=(doubted,))
    fit = SimpleNamespace(effects=(name,), twin=SimpleNamespace(measured_laws={}))
    names, perhaps, _ = ask_names_again(findings, None, None, fit, fit)
    assert [effect.effect for effect in names] == [name] * regained
    assert [effect.effect for effect in perhaps] == [name] * (not regained)
    assert all(effect.is_sure for effect in names)
