"""Sets of effects are weighed by how well they predict windows that are left out."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_fits import make_errors, make_fit

from pendulum_sysid.finding.weights import WeighedSet, weigh_effect, weigh_sets

FRICTION, LAG = "cart_coulomb_friction", "motor_lag"


def test_a_set_that_is_clearly_better_has_all_the_weight() -> None:
    off = make_errors(1)
    good, poor = make_fit(off, (FRICTION,)), make_fit(1.5 * off)
    sets = weigh_sets([poor], good)
    assert sets[0].effects == (FRICTION,) and sets[0].weight == 1.0
    assert weigh_effect(sets, FRICTION) == 1.0


def test_two_sets_that_do_as_well_share_the_weight() -> None:
    random, off = np.random.default_rng(0), make_errors(1, windows=45)
    both = [
        make_fit(off * random.lognormal(0.0, 0.2, off.shape), effects)
        for effects in ((FRICTION,), (LAG,))
    ]
    sets = weigh_sets(both, both[0])
    assert sum(s.weight for s in sets) == pytest.approx(1.0)
    assert all(0.02 < s.weight < 0.98 for s in sets), sets


def test_fits_over_another_horizon_are_not_compared() -> None:
    off = make_errors(1)
    best = make_fit(off, (FRICTION,))
    sets = weigh_sets([replace(make_fit(0.1 * off), pieces=4)], best)
    assert [s.effects for s in sets] == [(FRICTION,)]


def test_of_two_sets_that_predict_alike_the_smaller_counts() -> None:
    off = make_errors(1)
    sets = weigh_sets([make_fit(off, (FRICTION, LAG))], make_fit(off, (FRICTION,)))
    assert sets[0].effects == (FRICTION,) and sets[0].weight == 1.0


def test_a_set_holds_an_effect_with_its_relatives_and_with_what_it_cannot_be_told_from() -> None:
    sets = (
        WeighedSet(("cart_stribeck_friction",), 0.5),  # contains Coulomb friction
        WeighedSet(("rail_tilt",), 0.3),
        WeighedSet((LAG,), 0.2),
    )
    assert weigh_effect(sets, FRICTION) == pytest.approx(0.5)
    assert weigh_effect(sets, FRICTION, ("rail_tilt",)) == pytest.approx(0.8)
    assert weigh_effect(sets, "cart_stribeck_friction") == pytest.approx(0.5)
    assert weigh_effect(sets, "input_delay") == 0.0
