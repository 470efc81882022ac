"""A cause has one size in every environment; what stands in its place has not."""

import numpy as np
import pytest
from support.hidden_physics import HIDDEN, INTECO, record_hidden

from pendulum_sysid.finding.environments import (
    Steadiness,
    list_environments,
    measure_steadiness,
)
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.naming import Named
from pendulum_sysid.finding.propose import propose
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Fit

PATCH = {"rail_friction_patch": {"level_n": 2.5, "centre_m": 0.05, "width_m": 0.07}}
TILTED = {"cart_coulomb_friction": {"level_n": 0.5}, "rail_tilt": HIDDEN["rail_tilt"]}


def fit_dry_friction(hidden: dict) -> tuple[Search, Fit]:
    case = prepare_case([record_hidden(hidden, 3, 20.0)[0]], INTECO)
    search = Search(case, split_windows(case.signals, case.state))
    base = fit_parameters_alone(search)
    proposals = {p.effect: p for p in propose(case, search.split, base)}
    dry = proposals["cart_coulomb_friction"]
    return search, search.fit_effects(dry.effects, base, dry.theta)


@pytest.mark.parametrize(("hidden", "steady"), [(TILTED, True), (PATCH, False)])
def test_friction_beside_something_else_is_steady_and_a_patch_of_friction_is_not(
    hidden: dict, steady: bool
) -> None:
    search, fit = fit_dry_friction(hidden)
    assert fit.choose > 1.5, "the fit lacks something"
    measured = measure_steadiness(search.case, search.split, fit)["cart_coulomb_friction"]
    assert (measured.is_steady, measured.is_contradicted) == (steady, not steady)
    if steady:
        assert abs(np.median(measured.shares) - 1.0) < 0.1


def test_environments_cover_all_windows_once_for_each_question() -> None:
    search, _ = fit_dry_friction(TILTED)
    environments = list_environments(search.case, search.split)
    assert len(environments) == 21
    whole = np.arange(len(search.split.learn))
    for thirds in zip(*[iter(environments)] * 3, strict=True):
        assert np.array_equal(np.sort(np.concatenate(thirds)), whole)


EVERYWHERE = np.full(21, 0.1)


@pytest.mark.parametrize(
    ("share", "deviation", "steady", "contradicted"),
    [
        (1.1, 0.1, True, False),
        (0.45, 0.1, False, False),  # not surely smaller than half
        (0.2, 0.1, False, True),
        (1.8, 0.1, False, True),
        (-3.0, 5.0, True, False),  # that environment shows nothing
        (0.3, 0.2, False, False),
        (1.77, 0.42, True, False),  # a motion that tells the size to 0.8 of it
        (0.74, 0.45, True, False),
        (1.77, 0.13, False, True),
        (np.nan, np.inf, True, False),
    ],
)
def test_an_environment_decides_only_where_it_can_show_the_effect(
    share: float, deviation: float, steady: bool, contradicted: bool
) -> None:
    shares, deviations = np.ones(21), EVERYWHERE.copy()
    shares[4], deviations[4] = share, deviation
    measured = Steadiness(shares, deviations)
    assert (measured.is_steady, measured.is_contradicted) == (steady, contradicted)
    named = Named("rail_tilt", None, steadiness=measured)
    assert (named.is_steady, named.is_lasting) == (steady, not contradicted)


def test_few_environments_that_could_show_an_effect_prove_nothing() -> None:
    deviations = np.full(21, 3.0)
    deviations[:10] = 0.1
    assert not Steadiness(np.ones(21), deviations).is_steady
    assert Steadiness(np.ones(21), EVERYWHERE).is_steady
