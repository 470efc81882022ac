"""The order in which curves are asked for their formulas."""

from types import SimpleNamespace

import numpy as np
import pytest

from pendulum_sysid.measuring import measure, naming
from pendulum_twin.laws import BY_NAME
from pendulum_twin.parameter_vector import LAW_SIZE, LAWS


@pytest.mark.parametrize("first", [True, False])
def test_curves_over_time_may_be_asked_first(monkeypatch: pytest.MonkeyPatch, first: bool) -> None:
    """Each formula leaves a little more than its curve; a curve over time goes without formula."""
    kinds = ("cart_drag_along_rail", "drive_gain_over_time", "cart_drag_by_pole_rate")
    knots, asked = np.linspace(0.0, 1.0, 4), []
    curves = [
        SimpleNamespace(kind=BY_NAME[kind], knots=knots, get_values=lambda theta: np.zeros(4))
        for kind in kinds
    ]

    def ask(case: object, split: object, fit: int, curve: SimpleNamespace, *about: object):
        asked.append(curve.kind.name)
        return SimpleNamespace(theta=None), curve, None

    monkeypatch.setattr(naming, "_try_shapes", ask)
    law_fit = SimpleNamespace(
        fit=SimpleNamespace(theta=np.zeros(LAWS + LAW_SIZE)),
        curves=curves,
        values=[np.zeros(4)] * 3,
        covariances=[np.eye(4)] * 3,
        priors=[SimpleNamespace(effective=2.0)] * 3,
        inflation=4.0,
    )
    _, named = naming.name_curves(None, None, law_fit, first)  # type: ignore[arg-type]
    assert asked == ([kinds[1], kinds[0], kinds[2]] if first else [*kinds])
    assert tuple(curve.curve.kind.name for curve in named) == kinds


@pytest.mark.parametrize(("is_complete", "orders"), [(False, [False]), (True, [False, True])])
def test_a_curve_over_time_without_a_formula_is_asked_again_at_the_end(
    monkeypatch: pytest.MonkeyPatch, is_complete: bool, orders: list[bool]
) -> None:
    asked = []

    def name(case: object, split: object, law_fit: object, time_first: bool = False):
        asked.append(time_first)
        return None, (SimpleNamespace(shape="wave" if time_first else None),)

    monkeypatch.setattr(measure, "name_curves", name)
    curves = (SimpleNamespace(kind=BY_NAME["drive_gain_over_time"]),)
    law_fit = SimpleNamespace(curves=curves)
    measured = measure.Measured(None, None, law_fit, is_complete=is_complete)  # type: ignore[arg-type]
    assert measured.named[1][0].shape == ("wave" if is_complete else None)
    assert asked == orders
