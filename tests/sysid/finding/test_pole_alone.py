"""The pole by itself names a small effect that is the same everywhere, and keeps it."""

from dataclasses import replace

import numpy as np
import pytest
from support.made_recordings import INTECO, made

from pendulum_sysid import decisions
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.finding import search as search_module
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.need import needs_effect
from pendulum_sysid.finding.pole_alone import (
    PoleAnswer,
    add_pole_effects,
    put_pole_on_moving_axis,
    search_pole_alone,
)
from pendulum_sysid.finding.search import Explanation, begin_with_subsets, extend_horizon
from pendulum_sysid.finding.signs import fit_parameters_alone
from pendulum_sysid.fitting.split import split_windows
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Fit
from pendulum_twin.laws.law import Law, spread_turn
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS

RIG = Twin("rig", INTECO.rig)
DRAG = "pole_quadratic_drag"
TURN = spread_turn(20, 2.0 * np.pi)


def search_rig(drag: float, torque_n_m: float) -> tuple[Search, Fit]:
    """Return a search of a rig with a drag of the pole, and a torque without a name."""
    truth = replace(
        RIG,
        effects={DRAG: {"n_m_s2": drag}},
        measured_laws={
            "pole_torque_by_angle": Law(tuple(TURN), tuple(torque_n_m * np.sin(3.0 * TURN)))
        },
    )
    prepared = prepare([made(truth, 40.0, amplitude=0.4)], RIG)
    search = Search(prepared.case, prepared.split)
    return search, fit_parameters_alone(search)


def ask_pole(search: Search, base: Fit) -> PoleAnswer:
    answer = search_pole_alone(search, base)
    assert answer is not None
    return answer


@pytest.mark.parametrize(("drag", "torque_n_m"), [(2e-5, 0.002), (4e-5, 0.004)])
def test_a_drag_that_is_the_same_everywhere_shows_beside_a_larger_torque(
    monkeypatch, drag: float, torque_n_m: float
) -> None:
    search, base = search_rig(drag, torque_n_m)
    answer = ask_pole(search, base)
    assert answer.effects == answer.steady == (DRAG,)
    assert answer.best.estimates[f"{DRAG}.n_m_s2"].value == pytest.approx(drag, rel=0.1)
    monkeypatch.setattr(decisions, "ACCEPT_STEADY", False)
    assert ask_pole(search, base).effects == (), "small beside what is left"


@pytest.mark.parametrize("torque_n_m", [0.002, 0.004])
def test_a_torque_without_a_name_gets_no_name(torque_n_m: float) -> None:
    assert ask_pole(*search_rig(0.0, torque_n_m)).effects == ()


def test_steadiness_counts_for_the_pole_alone() -> None:
    """On the whole rig an eccentric pulley is as steady in the place of an uneven drive."""
    search, base = search_rig(2e-5, 0.002)
    answer = ask_pole(search, base)
    pair = answer.best, answer.base
    assert needs_effect(answer.search, *pair, DRAG)
    assert not needs_effect(replace(answer.search, is_pole_alone=False), *pair, DRAG)


def test_sets_begin_beside_what_the_pole_shows(monkeypatch) -> None:
    search, base = search_rig(4e-5, 0.004)
    answer = ask_pole(search, base)
    start = add_pole_effects(search, base, answer.best, answer.steady)
    asked = []
    monkeypatch.setattr(
        search_module,
        "find_subsets",
        lambda _, fit, most: asked.append((fit.effects, most)) or [],
    )
    for pole, shown in ((answer, (DRAG,)), (replace(answer, steady=()), ())):
        explanation = Explanation(start, pole)
        assert begin_with_subsets(search, base, explanation) is explanation
        most = decisions.SUBSET_EFFECTS - len(shown)  # a set is no larger for what it begins with
        assert asked.pop() == ((*base.effects, *shown), most)


def test_what_only_the_long_horizon_shows_is_not_kept(monkeypatch) -> None:
    """A second that begins near upright seems to need whatever bends the motion."""
    search, base = search_rig(4e-5, 0.004)
    spring = "pole_spring"

    def grow(search: Search, fit: Fit) -> Fit:
        theta = fit.theta.copy()
        theta[SLOTS[spring]] = 1e-4
        return search.fit_effects((*fit.effects, spring), fit, theta)

    monkeypatch.setattr(search_module, "grow_set", grow)
    monkeypatch.setattr(search_module, "prune_set", lambda search, kept, fit, expected=(): fit)
    short = Explanation(base, None)
    assert base.choose > decisions.MISFIT_AT_NOISE
    assert spring not in extend_horizon(search, base, short).fit.effects
    monkeypatch.setattr(search_module, "is_shown_near", lambda near, short: True)
    assert spring in extend_horizon(search, base, short).fit.effects


def test_too_few_windows_of_both_joints_are_no_error() -> None:
    """Each joint is seen in four windows, and both together in three."""
    recording = made(RIG, 4.1, amplitude=0.4)
    at = np.arange(len(recording.signals))
    parted = replace(
        recording.signals,
        cart_valid=(at < 20) | (at > 55),
        pole_valid=(at < 56) | (at > 83),
    )
    prepared = prepare([replace(recording, signals=parted)], RIG)
    search = Search(prepared.case, prepared.split)
    base = fit_parameters_alone(search)
    alone = put_pole_on_moving_axis(search.case, base.theta)
    assert alone is not None
    with pytest.raises(UnusableRecording, match="found 3"):
        split_windows(alone.signals, alone.state)
    assert search_pole_alone(search, base) is None
