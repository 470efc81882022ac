"""Rules of the pipeline between the search's answer and the verdict."""

from types import SimpleNamespace

import numpy as np
import pytest

from pendulum_sysid import pipeline
from pendulum_sysid.finding.localisation.shape_check import Misfit
from pendulum_sysid.pipeline import ask_shapes_again
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
