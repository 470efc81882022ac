"""Trials: the mix of kinds is even, a trial depends on its number alone, its folder is whole."""

import json
from collections import Counter

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from pendulum_bridge.emulator.concealable import TABLE
from pendulum_bridge.emulator.rest import COUNT
from pendulum_bridge.emulator.seal import open_seal
from pendulum_bridge.emulator.unlisted.table import TABLE as UNLISTED
from pendulum_bridge.studies import trials
from pendulum_bridge.studies.trial.controller import BEGIN_S
from pendulum_bridge.studies.trial.mix import (
    EFFECTS_OF_KIND,
    USUAL_SHARES,
    find_kind,
    parse_shares,
)
from pendulum_bridge.studies.trial.trial import draw_trial, draw_trial_with
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin
from pendulum_twin.rig import Rig


def test_every_stretch_has_its_share_of_every_kind() -> None:
    kinds = [find_kind(k, USUAL_SHARES)[0] for k in range(100)]
    assert Counter(kinds) == USUAL_SHARES
    for end in range(1, 101):
        counts = Counter(kinds[:end])
        assert all(
            abs(counts[kind] - share * end / 100) < 1 for kind, share in USUAL_SHARES.items()
        )


def test_turns_count_up_within_a_kind() -> None:
    turns = [find_kind(k, {"single": 1, "pair": 1}) for k in range(6)]
    assert turns == [
        ("single", 0),
        ("pair", 0),
        ("single", 1),
        ("pair", 1),
        ("single", 2),
        ("pair", 2),
    ]


@pytest.mark.parametrize(
    "text", ["", "single", "single:0", "ghost:3", "single:1,single:2", "single:-1", "pair:x"]
)
def test_shares_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(BadInputError, match=r"^expected "):
        parse_shares(text)


def test_a_misspelt_kind_is_refused_with_the_kind_that_was_meant() -> None:
    with pytest.raises(BadInputError, match=r"found 'singel:1'; did you mean single\?$"):
        parse_shares("singel:1")


def test_shares_are_read() -> None:
    assert parse_shares("nothing:15, single:40") == {"nothing": 15, "single": 40}


def test_singles_and_unlisted_go_round_all_that_there_are(nominal: Rig) -> None:
    alone = [effect.name for effect in TABLE if not effect.beside]
    for kind, names in (("single", alone), ("unlisted", [law.name for law in UNLISTED])):
        drawn = [draw_trial(k, 3, {kind: 1}, nominal).concealed for k in range(2 * len(names))]
        assert Counter(
            name for trial in drawn for name in (*trial.effects, *trial.unlisted)
        ) == dict.fromkeys(names, 2)


@pytest.mark.parametrize("kind", EFFECTS_OF_KIND)
def test_a_kind_conceals_as_many_as_it_says(kind: str, nominal: Rig) -> None:
    for k in range(30):
        concealed = draw_trial(k, 1, {kind: 1}, nominal).concealed
        assert len(concealed.effects) == EFFECTS_OF_KIND[kind] and len(concealed.unlisted) == (
            kind == "unlisted"
        )
        assert concealed.rig != nominal


def test_given_sets_take_turns(nominal: Rig) -> None:
    sets = (("input_delay", "rail_tilt"), ("cogging",), ("air_jet",), ("hanging_cable", "cogging"))
    drawn = [draw_trial_with(k, 1, sets, nominal) for k in range(5)]
    assert [trial.kind for trial in drawn] == ["pair", "single", "unlisted", "unlisted", "pair"]
    assert [tuple(trial.concealed.effects) for trial in drawn[:2]] == list(sets[:2])
    assert drawn[0].concealed.effects != drawn[4].concealed.effects  # drawn anew


def run_trials(*arguments: str) -> int:
    return trials.main(["--seconds", "40", "--rate-hz", "25", *arguments])


def read_contents(folder) -> tuple:
    with AnyReader([folder / "bag"]) as reader:
        messages = [
            (connection.topic, stamp, reader.deserialize(raw, connection.msgtype))
            for connection, stamp, raw in reader.messages()
        ]
    states = np.array(
        [[*m.position, *m.velocity] for topic, _, m in messages if topic == "/rig/joint_states"]
    )
    commands = np.array([m.data for topic, _, m in messages if topic == "/rig/pwm"])
    return states.tolist(), commands.tolist(), json.loads((folder / "seal.json").read_text())


def test_a_trial_is_the_same_whatever_else_is_recorded(tmp_path, capsys, nominal: Rig) -> None:
    assert run_trials("--out", str(tmp_path / "all"), "--trials", "2", "--seed", "5") == 0
    assert capsys.readouterr().out.split() == [
        str(tmp_path / "all" / f"trial_{k:04d}") for k in range(2)
    ]
    assert (
        run_trials("--out", str(tmp_path / "one"), "--trials", "1", "--seed", "5", "--first", "1")
        == 0
    )
    first, again = (read_contents(tmp_path / run / "trial_0001") for run in ("all", "one"))
    assert first == again and read_contents(tmp_path / "all" / "trial_0000") != again
    folder = tmp_path / "all" / "trial_0001"
    assert sorted(path.name for path in folder.iterdir()) == [
        "bag",
        "seal.json",
        "trial.json",
        "twin.yaml",
    ]
    assert (
        load_twin(folder / "twin.yaml").rig == nominal
        and not load_twin(folder / "twin.yaml").effects
    )
    assert open_seal(folder / "seal.json").rig != nominal
    assert len(first[0]) == len(first[1]) == 1000
    assert sorted(path.name for path in (tmp_path / "all").iterdir()) == [
        f"trial_{k:04d}" for k in range(2)
    ]


def test_how_it_was_made_is_written_down(tmp_path, capsys) -> None:
    options = (
        "--effects",
        "cart_coulomb_friction+input_delay",
        "--size-factor",
        "0.5",
        "--pole-counts",
        "1024",
    )
    assert (
        run_trials(
            "--out", str(tmp_path), "--trials", "1", "--seed", "5", "--closed-loop", *options
        )
        == 0
    )
    content = json.loads((tmp_path / "trial_0000" / "trial.json").read_text())
    seed = content.pop("seed")
    assert content == {
        "schema": "pendulum_trial/1", "kind": "pair", "pole_counts": 1024,
        "seconds": 40.0, "closed_loop": True, "relay": False,
        "size_factor": 0.5, "pairs": False,
    }  # fmt: skip
    assert isinstance(seed, int)
    states, commands, seal = read_contents(tmp_path / "trial_0000")
    assert seal["effects"]["input_delay"]["delay_s"] <= 0.025 and np.std(commands) > 0.01
    assert (
        np.max(np.abs(np.array(states)[:, 1] / (2 * np.pi / 1024) % 1 - 0.5)) > 0.499
    )  # whole counts


def test_a_relay_knows_three_commands(tmp_path) -> None:
    options = ("--effects", "cart_coulomb_friction", "--relay")
    assert run_trials("--out", str(tmp_path), "--trials", "1", "--seed", "5", *options) == 0
    content = json.loads((tmp_path / "trial_0000" / "trial.json").read_text())
    assert content["relay"] and content["closed_loop"]
    commands = np.array(read_contents(tmp_path / "trial_0000")[1])
    after = commands[round(BEGIN_S * 100) + 1 :]  # the push that shows the signs has ended
    assert len(np.unique(after)) == 3 and np.all(np.unique(after) == [-0.3, 0.0, 0.3])


def test_a_rig_with_a_rest_is_recorded_twice(tmp_path, capsys) -> None:
    options = ("--effects", "rail_tilt", "--pairs", "--rest")
    assert run_trials("--out", str(tmp_path), "--trials", "1", "--seed", "5", *options) == 0
    folder = tmp_path / "trial_0000"
    (folder / "second").mkdir()
    (folder / "other").rename(folder / "second" / "bag")
    (folder / "second" / "seal.json").write_bytes((folder / "seal.json").read_bytes())
    first, second = read_contents(folder), read_contents(folder / "second")
    assert first[0] != second[0] and first[1] != second[1]
    assert len(open_seal(folder / "seal.json").rest) == COUNT
    assert json.loads((folder / "trial.json").read_text())["pairs"]


def test_what_is_there_is_not_overwritten(tmp_path, capsys) -> None:
    (tmp_path / "trial_0000").mkdir()
    assert run_trials("--out", str(tmp_path), "--trials", "1", "--seed", "5") == 1
    assert "trials are not overwritten" in capsys.readouterr().err and not any(
        (tmp_path / "trial_0000").iterdir()
    )


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        (("--effects", "ghost"), "expected effects that can be concealed"),
        (("--kinds", "ghost:1"), "argument --kinds: expected KIND:SHARE"),
        (("--seconds", "3"), "expected a number from 40"),
        (("--trials", "-3"), "expected a whole number"),
    ],
)
def test_wrong_use_ends_with_2_and_a_sentence(wrong, sentence: str, tmp_path, capsys) -> None:
    with pytest.raises(SystemExit) as ended:
        trials.main(["--out", str(tmp_path), "--trials", "1", "--seed", "1", *wrong])
    assert ended.value.code == 2 and sentence in capsys.readouterr().err
