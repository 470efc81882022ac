"""The thesis's procedure lowers its own number, keeps its bounds and says what it moved."""

from dataclasses import replace

import pytest
from support.made_recordings import INTECO, made, without_joint

from pendulum_sysid.fitting.thesis_fit import SEARCHED, ThesisFit, fit_as_thesis
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.records import Recording
from pendulum_twin.effects import BY_NAME
from pendulum_twin.errors import BadInputError
from pendulum_twin.laws.law import Law
from pendulum_twin.model import Twin

EVALUATIONS = 250
TRUTH = replace(
    INTECO,
    rig=replace(INTECO.rig, force_per_pwm_n=11.0),
    effects={"cart_coulomb_friction": {"level_n": 0.6}},
)


def silent(_: str) -> None:
    pass


@pytest.fixture(scope="module")
def recording() -> Recording:
    return made(TRUTH, 6.0, 0.2)


@pytest.fixture(scope="module")
def found(recording: Recording) -> ThesisFit:
    return fit_as_thesis(prepare_case([recording], INTECO), silent, EVALUATIONS)


def test_equation_29_gets_better(found: ThesisFit) -> None:
    assert found.after < 0.7 * found.before
    assert not found.converged
    assert EVALUATIONS <= found.evaluations <= EVALUATIONS + 1


def test_all_twelve_are_reported_within_their_bounds(found: ThesisFit) -> None:
    assert [one.name for one in found.moved] == [one.name for one in SEARCHED]
    assert len(found.moved) == 12
    for one, searched in zip(found.moved, SEARCHED, strict=True):
        assert searched.low <= one.fitted <= searched.high
        assert one.percent == pytest.approx(100 * (one.fitted / one.start - 1))
    assert {one.unit for one in found.moved} == {
        "kg", "N m s/rad", "N s/m", "N", "m", "kg m^2", "m/s^2", "m/s", "rad/s",
    }  # fmt: skip


def test_starts_are_the_published_ones(found: ThesisFit) -> None:
    starts = {one.name: one.start for one in found.moved}
    assert starts["cart_saturating_friction.viscous_n_s_m"] == 1.1975875
    assert starts["thesis_dead_zones.force_n"] == 0.093125
    assert starts["force_per_pwm_n"] == INTECO.rig.force_per_pwm_n
    assert starts["pole_inertia_kg_m2"] == INTECO.rig.pole_inertia_kg_m2


def test_the_twin_holds_the_thesis_model(found: ThesisFit) -> None:
    assert found.twin.rig.cart_viscous_n_s_m == 0.0
    assert found.twin.effects["cart_saturating_friction"]["limit_n"] == 1.0
    assert set(found.twin.effects) == {"cart_saturating_friction", "thesis_dead_zones"}


def test_the_same_input_gives_the_same_twin(recording: Recording) -> None:
    first, second = (
        fit_as_thesis(prepare_case([recording], INTECO), silent, 40) for _ in range(2)
    )
    assert first == second


def test_signs_are_kept_and_other_effects_left_out_by_name(recording: Recording) -> None:
    lag = {p.name: 0.02 for p in BY_NAME["motor_lag"].parameters}
    twin = replace(INTECO, effects={"cart_sign_inverted": {}, "motor_lag": lag})
    found = fit_as_thesis(prepare_case([recording], twin), silent, 20)
    assert "cart_sign_inverted" in found.twin.effects and "motor_lag" not in found.twin.effects
    assert found.dropped == ("motor_lag",)


def test_measured_laws_are_left_out_by_name(recording: Recording) -> None:
    """They went without a word, for effects alone were told."""
    law = Law((-0.3, 0.0, 0.3), (0.5, 0.0, -0.5))
    lag = {p.name: 0.02 for p in BY_NAME["motor_lag"].parameters}
    twin = replace(
        INTECO, effects={"motor_lag": lag}, measured_laws={"cart_force_by_position": law}
    )
    found = fit_as_thesis(prepare_case([recording], twin), silent, 1)
    assert not found.twin.measured_laws
    assert found.dropped == ("motor_lag", "cart_force_by_position")


def test_a_value_at_its_bound_is_told(recording: Recording) -> None:
    twin = replace(INTECO, rig=replace(INTECO.rig, gravity_m_s2=15.0))
    found = fit_as_thesis(prepare_case([recording], twin), silent, 1)
    assert {one.name for one in found.moved if one.at_bound} == {"gravity_m_s2"}


def test_progress_is_told(recording: Recording) -> None:
    lines: list[str] = []
    fit_as_thesis(prepare_case([recording], INTECO), lines.append, 210)
    assert len(lines) == 1 and lines[0].startswith("200 evaluations, equation 29 down to ")


def test_a_cart_alone_is_refused(recording: Recording) -> None:
    with pytest.raises(
        BadInputError, match="expected a recording of cart and pole, found no pole"
    ):
        fit_as_thesis(prepare_case([without_joint(recording, "pole")], INTECO), silent, 10)


def test_a_rig_beyond_the_bounds_is_refused(recording: Recording) -> None:
    twin = Twin("big", replace(INTECO.rig, pole_inertia_kg_m2=0.5))
    with pytest.raises(
        BadInputError, match=r"pole_inertia_kg_m2 from 1e-09 to 0\.01 kg m\^2, found 0\.5"
    ):
        fit_as_thesis(prepare_case([recording], twin), silent, 10)
