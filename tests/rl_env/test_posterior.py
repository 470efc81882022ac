"""Twins drawn from a verdict's intervals."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.posterior import gather_knowledge
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TWIN = Twin(
    "rig", INTECO.rig, {"cart_coulomb_friction": {"level_n": 1.0}, "cart_sign_inverted": {}}
)
FORCE = INTECO.rig.force_per_pwm_n


def write_verdict(folder: Path, **more: object) -> Path:
    verdict_content = {
        "schema": "pendulum_verdict/1",
        "missing_physics": [
            {
                "effect": "cart_coulomb_friction",
                "parameters": {"level_n": {"value": 1.0, "low": 0.8, "high": 1.2}},
            },
            {"effect": "cart_sign_inverted", "parameters": {}},
        ],
        "rig_parameters": {
            "force_per_pwm_n": {"after": FORCE, "low": FORCE - 0.392, "high": FORCE + 0.392},
            "pole_viscous_n_m_s": {"after": 2.7e-4, "low": None, "high": None},
        },
        "recording": {"position_step_m": 57e-6, "angle_step_rad": 0.0015},
        **more,
    }
    file = folder / "verdict.json"
    file.write_text(json.dumps(verdict_content), encoding="utf-8")
    return file


def test_draws_have_the_spread_of_the_intervals(tmp_path: Path) -> None:
    knowledge = gather_knowledge(TWIN, write_verdict(tmp_path), 400, 1)
    assert knowledge.twins[0] is TWIN and len(knowledge.twins) == 401
    forces = np.array([twin.rig.force_per_pwm_n for twin in knowledge.twins[1:]])
    levels = np.array(
        [twin.effects["cart_coulomb_friction"]["level_n"] for twin in knowledge.twins[1:]]
    )
    assert forces.mean() == pytest.approx(FORCE, abs=0.05) and forces.std() == pytest.approx(
        0.2, rel=0.15
    )
    assert levels.mean() == pytest.approx(1.0, abs=0.02) and levels.std() == pytest.approx(
        0.102, rel=0.15
    )
    assert all(
        twin.rig.pole_viscous_n_m_s == TWIN.rig.pole_viscous_n_m_s for twin in knowledge.twins
    )
    assert all("cart_sign_inverted" in twin.effects for twin in knowledge.twins)
    assert knowledge.encoders.steps == (57e-6, 0.0015)


def test_draws_repeat_with_the_seed_and_stay_within_what_can_be(tmp_path: Path) -> None:
    wide = {
        "effect": "cart_coulomb_friction",
        "parameters": {"level_n": {"value": 1.0, "low": -9.0, "high": 11.0}},
    }
    file = write_verdict(tmp_path, missing_physics=[wide])
    first, second = (gather_knowledge(TWIN, file, 50, 3).twins for _ in range(2))
    assert first == second
    assert min(twin.effects["cart_coulomb_friction"]["level_n"] for twin in first) == 0.0


def test_draws_hang_together_as_the_verdict_says(tmp_path: Path) -> None:
    estimates = {
        "force_per_pwm_n": {"after": TWIN.rig.force_per_pwm_n, "low": 12.0, "high": 13.72},
        "cart_viscous_n_s_m": {"after": TWIN.rig.cart_viscous_n_s_m, "low": 0.45, "high": 0.55},
    }
    names = [*estimates, "cart_coulomb_friction.level_n"]
    values = [[1.0, 0.9, None], [0.9, 1.0, None], [None, None, None]]
    file = write_verdict(
        tmp_path, rig_parameters=estimates, correlations={"names": names, "values": values}
    )
    drawn = gather_knowledge(TWIN, file, 2000, 3).twins[1:]
    rows = np.array(
        [
            (
                t.rig.force_per_pwm_n,
                t.rig.cart_viscous_n_s_m,
                t.effects["cart_coulomb_friction"]["level_n"],
            )
            for t in drawn
        ]
    )
    found = np.corrcoef(rows.T)
    assert found[0, 1] == pytest.approx(0.9, abs=0.02)
    assert abs(found[0, 2]) < 0.07 and abs(found[1, 2]) < 0.07
    assert rows[:, 0].std() == pytest.approx((13.72 - 12.0) / 3.92, rel=0.06)


def test_without_a_verdict_there_is_the_twin_alone() -> None:
    knowledge = gather_knowledge(TWIN, None, 64, 0)
    assert knowledge.twins == (TWIN,) and knowledge.encoders.steps == (0.0, 0.0)


@pytest.mark.parametrize("text", ["", "[]", '{"schema": "other/1"}', "{"])
def test_what_is_no_verdict_is_refused(tmp_path: Path, text: str) -> None:
    file = tmp_path / "v.json"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(BadInputError, match=r"v\.json: expected a verdict"):
        gather_knowledge(TWIN, file, 1, 0)


def test_constants_that_no_bodies_have_together_are_drawn_again(tmp_path: Path) -> None:
    least = INTECO.rig.moment_kg_m**2 / INTECO.rig.total_mass_kg
    rig = replace(INTECO.rig, pole_inertia_kg_m2=1.05 * least)
    wide = {"pole_inertia_kg_m2": {"after": 1.05 * least, "low": 0.0, "high": 1.0}}
    file = write_verdict(tmp_path, rig_parameters=wide)
    drawn = gather_knowledge(Twin("edge", rig, TWIN.effects), file, 50, 3).twins[1:]
    inertias = np.array([twin.rig.pole_inertia_kg_m2 for twin in drawn])
    assert inertias.min() > least and inertias.std() > 0.05 * least


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ({"outcome": "unusable"}, "the recording could not be used"),
        (
            {"rig_parameters": {"force_per_pwm_n": {"after": 9.0, "low": 8.9, "high": 9.1}}},
            "the verdict of this twin, found force_per_pwm_n 9 in the verdict and 12.86",
        ),
        (
            {
                "missing_physics": [
                    {
                        "effect": "cart_coulomb_friction",
                        "parameters": {"level_n": {"value": 0.1, "low": 0.09, "high": 0.11}},
                    }
                ]
            },
            "found cart_coulomb_friction.level_n 0.1 in the verdict and 1 in the twin",
        ),
        ({"missing_physics": [{"parameters": {"level_n": {}}}]}, "missing or odd"),
        ({"missing_physics": "none"}, "missing or odd"),
        ({"rig_parameters": {"force_per_pwm_n": 3}}, "missing or odd"),
        ({"recording": {"position_step_m": "small"}}, "missing or odd"),
    ],
)
def test_a_verdict_that_is_not_about_this_twin_is_refused(
    tmp_path: Path, more: dict, said: str
) -> None:
    with pytest.raises(BadInputError, match=said):
        gather_knowledge(TWIN, write_verdict(tmp_path, **more), 2, 0)
