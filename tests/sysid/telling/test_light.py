"""The traffic light, and what to do now: known verdicts, known colours and commands."""

from dataclasses import replace

import pytest
from support.drawn_verdicts import ORIGIN, make_named, make_unusable

from pendulum_sysid.records import Outcome, QualityFinding
from pendulum_sysid.telling.light import AMBER, BLUE, RED, compute_lost_share, judge_light
from pendulum_sysid.telling.steps import list_steps
from pendulum_sysid.telling.window_list import find_worst, list_windows
from pendulum_sysid.verdict.record import Verdict
from pendulum_sysid.verdict.scores import Remainder


def say_remains(floors: float) -> Verdict:
    return replace(make_named(), remainder=Remainder("cart", floors, "depends on nothing"))


@pytest.mark.parametrize(
    ("verdict", "colour"),
    [
        (make_named(), BLUE),
        (replace(make_named(), remainder=None), BLUE),
        (say_remains(2.9), BLUE),
        (say_remains(3.1), AMBER),
        (replace(make_named(), outcome=Outcome.AMBIGUOUS), AMBER),
        (replace(make_named(), outcome=Outcome.NOT_IN_CATALOGUE), AMBER),
        (replace(make_named(), rig_changed=True), AMBER),
        (replace(make_named(), warnings=("measure it again.",)), AMBER),
        (replace(make_named(), data_quality=(QualityFinding("gap", 1, ((1.0, 3.0),)),)), AMBER),
        (replace(make_named(), data_quality=(QualityFinding("gap", 11, ()),)), AMBER),
        (replace(make_named(), data_quality=(QualityFinding("gap", 1, ((1.0, 1.1),)),)), BLUE),
        (replace(make_named(), unlike_rig=True), RED),
        (make_unusable(), RED),
    ],
)
def test_blue_only_when_little_remains(verdict: Verdict, colour: str) -> None:
    light = judge_light(verdict)
    assert light.colour == colour and light.title and all(light.reasons)


def lose(seconds: float, *faults: QualityFinding) -> float:
    verdict = replace(make_named(), drawings=None, data_quality=faults)
    recording = replace(verdict.recording, seconds=seconds)
    return compute_lost_share(replace(verdict, recording=recording))


def test_the_time_of_a_pause_is_a_part_of_the_recording_and_counts_once() -> None:
    pause = QualityFinding("gap", 1, ((5.0, 35.0),))
    clipped = QualityFinding("clipped", 2, ((30.0, 36.0), (32.0, 33.0)))
    assert lose(40.0, pause) == pytest.approx(30.0 / 40.0)
    assert lose(40.0, clipped, pause) == pytest.approx(31.0 / 40.0)
    drawn = replace(make_named(), data_quality=(pause,))  # 60 s of samples end at 62 s
    assert compute_lost_share(drawn) == pytest.approx(30.0 / 61.99)


def list_commands(verdict: Verdict) -> list[str]:
    worst = find_worst(list_windows(verdict))
    steps = list_steps(verdict, judge_light(verdict), worst)
    return [command for step in steps for command in step.commands]


def test_a_good_twin_is_used_and_the_next_experiment_is_played() -> None:
    assert list_commands(make_named()) == [
        "twin_node --ros-args -p twin:=out/twin.yaml",
        "train --twin out/twin.yaml --verdict out/verdict.json --out policy",
        "recorder_node --ros-args -p out:=next_recording -p plan:=out/next.yaml",
        "excitation_node --ros-args -r __ns:=/excitation -p plan:=out/next.yaml "
        "-p twin_file:=config/inteco.yaml -p \"twin:=''\" -p listeners:=2",
        "sysid diagnose inteco_60s next_recording --twin config/inteco.yaml --out out_next",
        "sysid compare another_recording --twin config/inteco.yaml --twin out/twin.yaml",
    ]


def test_a_twin_that_is_not_this_rig_is_not_used() -> None:
    commands = list_commands(replace(make_named(), unlike_rig=True, next_experiment=None))
    assert commands == ["sysid check inteco_60s --twin config/inteco.yaml"]
    assert list_commands(replace(make_unusable(), origin=ORIGIN)) == commands


def test_no_twin_of_a_rig_that_changed_is_used() -> None:
    verdict = replace(make_named(), rig_changed=True, outcome=Outcome.NOT_IN_CATALOGUE)
    light = judge_light(verdict)
    assert light.reasons == ("the rig changed between the recordings",)
    steps = list_steps(verdict, light, None)
    assert [step.sentence for step in steps] == ["Diagnose each recording by itself."]


def test_options_and_odd_names_stand_in_the_commands() -> None:
    topics = ("--command-topic", "/rig/applied_pwm")
    origin = replace(ORIGIN, topics=topics, constants=("cart_mass_kg", "gravity"), folder="my out")
    commands = list_commands(replace(make_named(), origin=origin))
    assert "train --twin 'my out/twin.yaml'" in commands[1]
    assert "--command-topic /rig/applied_pwm" in commands[4] and "'my out_next'" in commands[4]
    assert "--hold cart_mass_kg,gravity" in commands[4]


def test_effects_of_the_users_own_stand_in_every_command_that_reads_a_twin() -> None:
    origin = replace(ORIGIN, effects=("my effects", "learned"))
    for verdict in (make_named(), replace(make_named(), unlike_rig=True)):
        for command in list_commands(replace(verdict, origin=origin)):
            if command.startswith("sysid "):
                assert "--effects 'my effects' --effects learned --twin" in command
            elif "recorder_node" not in command:  # it keeps the plan and reads no twin
                assert command.startswith("PENDULUM_EFFECTS='my effects:learned' ")


def test_without_files_the_steps_have_no_commands() -> None:
    verdict = replace(make_named(), origin=None)
    assert list_commands(verdict) == []
    assert len(list_steps(verdict, judge_light(verdict), None)) == 3
