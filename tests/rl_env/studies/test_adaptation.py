"""A rig that changes while it is driven: the programs of the study, its changes and its report."""

from dataclasses import replace
from pathlib import Path

import pytest
from support.hidden_physics import INTECO

from pendulum_rl_env.studies.adaptation import CHANGES, FRICTION, LOAD_KG
from pendulum_rl_env.studies.adaptation_report import draw_rewards, format_table
from pendulum_rl_env.studies.changing_rig import open_rig
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin, save_twin

RIG = replace(INTECO, effects={FRICTION: {"level_n": 0.4}})
EPISODE = {"start_s": 150.0, "step_s": 0.03, "reward": 471.0, "rewards": [0.9] * 200}
STUDY = {
    "good": 440.0,
    "changes": [
        {
            "change": "a load", "alarm": "drive: weaker", "sentence": "Nothing is missing.",
            "warnings": ["A cart of 0.77 kg."], "noticed_s": 21.0, "recorded_s": 91.0,
            "diagnosed_s": 100.0, "trained_s": 140.0, "back_s": 158.0,
            "episodes": [
                {**EPISODE, "controller": "old", "start_s": -20.0, "reward": 475.0},
                {**EPISODE, "controller": "new"},
                {**EPISODE, "controller": "new", "start_s": 170.0, "reward": 472.0},
            ],
        },
    ],
}  # fmt: skip


class Push:
    """Push the cart one way, and keep its velocities."""

    def reset(self) -> None:
        self.velocities: list[float] = []

    def __call__(self, measured: Floats) -> float:
        self.velocities.append(float(measured[2]))
        return 0.2


def test_what_changes_is_what_the_words_say() -> None:
    worn, late, loaded = (CHANGES[name][1](RIG) for name in ("friction", "delay", "load"))
    assert worn == replace(RIG, effects={FRICTION: {"level_n": 0.8}})
    assert late.effects == {**RIG.effects, "input_delay": {"delay_s": 0.02}}
    assert loaded.rig.cart_mass_kg == pytest.approx(RIG.rig.cart_mass_kg + LOAD_KG)
    moments = (rig.total_mass_kg * rig.com_distance_m for rig in (loaded.rig, RIG.rig))
    assert next(moments) == pytest.approx(next(moments))


def test_a_rig_changes_in_the_middle_of_an_episode(tmp_path: Path) -> None:
    """Real programs: the same push drives the cart out of the middle, the other way afterwards."""
    backwards = Twin("backwards", RIG.rig, {"input_sign_inverted": {}})
    files = tmp_path / "rig.yaml", tmp_path / "backwards.yaml"
    save_twin(RIG, files[0])
    save_twin(backwards, files[1])
    push, changed_s = Push(), []
    push.reset()
    with open_rig(tmp_path, *files, files[0]) as live:

        def attend(k: int) -> bool:
            if k == 8:
                changed_s.append(live.now_s)
                live.change()
            return k > 8 and push.velocities[-1] < 0

        played = live.play("push", push, attend)
        assert played.start_s < 0 < changed_s[0], "times count from the change"
        assert max(push.velocities) > 0.1 and push.velocities[-1] < 0, "it drives back"
        assert len(played.rewards) == len(push.velocities)
        assert not live.has_learned and live.alarm == ""
        live.disconnect()


def test_the_report_tells_times_and_rewards(tmp_path: Path) -> None:
    header, _, row, *rest = format_table(STUDY).splitlines()
    assert header.endswith("| new |"), "the old policy drove before the change only"
    assert row == "| a load | 21 | 91 | 100 | 140 | 158 | 471, 472 |"
    assert "- watch: drive: weaker" in rest
    assert "- diagnosis: Nothing is missing. A cart of 0.77 kg." in rest
    draw_rewards(STUDY, tmp_path / "rewards.png")
    assert (tmp_path / "rewards.png").stat().st_size > 10_000
