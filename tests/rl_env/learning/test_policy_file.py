"""`policy.zip` runs nothing when it is read; a file of stable-baselines3 needs `--trust`."""

import base64
import json
import os
import pickle
import tempfile
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile

import gymnasium as gym
import numpy as np
import pytest

pytest.importorskip("stable_baselines3")
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.torch import load as unpack
from safetensors.torch import save as pack
from stable_baselines3.common.vec_env import DummyVecEnv
from support.paths import CONFIG

from pendulum_rl_env import evaluate, train
from pendulum_rl_env.learning.learner import as_off_policy, make_learner
from pendulum_rl_env.learning.policies import load_policy, make_policy, save_policy
from pendulum_rl_env.learning.policy_file import FACTS, MOST_BYTES, WEIGHTS
from pendulum_rl_env.learning.preset import IN_PROCESS, Preset
from pendulum_rl_env.learning.replay_file import load_replay, save_replay
from pendulum_rl_env.learning.tensors import collect_tensors
from pendulum_twin.errors import BadInputError

TWIN = str(CONFIG / "inteco.yaml")
OFF_POLICY = {"learning_starts": 20, "buffer_size": 64, "batch_size": 8}
PRESETS = {
    "ppo": {"n_steps": 32, "batch_size": 16, "n_epochs": 1},
    "sac": OFF_POLICY,
    "tqc": OFF_POLICY,
    "crossq": OFF_POLICY,
}


def make_trained(algorithm: str):
    preset = Preset(algorithm, 64, 1, (8,), 1e-3, 64, settings=PRESETS[algorithm])
    learner = make_learner(preset, DummyVecEnv([lambda: gym.make(IN_PROCESS)]), 1, None)
    return learner.learn(40)


@pytest.fixture(scope="module")
def learner():
    return make_trained("ppo")


@pytest.mark.parametrize("algorithm", PRESETS)
def test_a_policy_comes_back_whole(tmp_path: Path, algorithm: str) -> None:
    before = make_trained(algorithm)
    save_policy(before, tmp_path / "policy.zip")
    after = load_policy(tmp_path / "policy.zip")
    assert type(after) is type(before) and after.num_timesteps == before.num_timesteps
    tensors, again = collect_tensors(before), collect_tensors(after)
    assert tensors.keys() == again.keys() and any("exp_avg" in name for name in tensors)
    assert all(torch.equal(tensors[name], again[name]) for name in tensors)
    for observation in np.random.default_rng(1).normal(size=(9, 5)).astype(np.float32):
        assert make_policy(after)(observation) == pytest.approx(make_policy(before)(observation))


def test_learning_without_logs_leaves_nothing_in_the_system_s_temporary_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    save_policy(make_trained("ppo"), tmp_path / "policy.zip")
    env = DummyVecEnv([lambda: gym.make(IN_PROCESS)])
    load_policy(tmp_path / "policy.zip", env=env).learn(40)
    assert not list((tmp_path / "temporary").glob("SB3-*"))


def test_it_holds_numbers_and_names_alone(tmp_path: Path, learner) -> None:
    save_policy(learner, tmp_path / "policy.zip")
    with ZipFile(tmp_path / "policy.zip") as archive:
        assert sorted(archive.namelist()) == sorted([FACTS, WEIGHTS])
        assert json.loads(archive.read(FACTS))["settings"]["n_steps"] == 32


class Trap:
    """Make a folder when it is unpickled: what any code could do."""

    def __init__(self, place: Path) -> None:
        self.place = place

    def __reduce__(self):
        return os.mkdir, (str(self.place),)


def set_trap(learner, file: Path, place: Path) -> Path:
    """Return a file of stable-baselines3 that runs code when its member `data` is read."""
    learner.save(file)
    with ZipFile(file) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    data = json.loads(members["data"])
    code = base64.b64encode(pickle.dumps(Trap(place))).decode()
    data["trap"] = {":type:": "<class>", ":serialized:": code}
    with ZipFile(file, "w") as archive:
        for name, content in {**members, "data": json.dumps(data).encode()}.items():
            archive.writestr(name, content)
    return file


def test_a_file_that_runs_code_is_not_read_without_trust(tmp_path: Path, learner, capsys) -> None:
    place = tmp_path / "trapped"
    file = set_trap(learner, tmp_path / "policy.zip", place)
    assert evaluate.main(["--policy", str(file), "--twin", TWIN]) == 1
    out = ["--out", str(tmp_path / "run"), "--twin", TWIN, "--timesteps", "64"]
    assert train.main(["--init", str(file), *out]) == 1
    said = capsys.readouterr().err
    assert said.count("give --trust if you trust its maker") == 2 and "Traceback" not in said
    assert not place.exists()
    assert load_policy(file, trust=True).num_timesteps == learner.num_timesteps
    assert place.exists()  # so the trap was one


@pytest.mark.parametrize("name", ["policy.pth", "data", "trap.pkl"])
def test_other_members_are_left_alone(tmp_path: Path, learner, name: str) -> None:
    """A pickle beside the weights is not opened, with trust or without."""
    file, place = tmp_path / "policy.zip", tmp_path / "trapped"
    save_policy(learner, file)
    with ZipFile(file, "a") as archive:
        archive.writestr(name, pickle.dumps(Trap(place)))
    for trust in (False, True):
        assert load_policy(file, trust=trust).num_timesteps == learner.num_timesteps
    assert not place.exists()


def rewrite(file: Path, change) -> None:
    """Put the file's members through change(facts, weights) -> (facts, weights)."""
    with ZipFile(file) as archive:
        facts, weights = json.loads(archive.read(FACTS)), archive.read(WEIGHTS)
    facts, weights = change(facts, weights)
    with ZipFile(file, "w", ZIP_DEFLATED) as archive:
        archive.writestr(FACTS, json.dumps(facts))
        archive.writestr(WEIGHTS, weights)


def poison(weights: bytes) -> bytes:
    tensors = unpack(weights)
    tensors["policy/action_net.bias"][0] = float("nan")
    return pack(tensors)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda f, w: (f, poison(w)), "policy/action_net.bias: expected finite weights"),
        (lambda f, w: ({**f, "layers": [9]}, w), "expected shape"),
        (lambda f, w: ({**f, "layers": [8, 8]}, w), "expected the tensors of these layers"),
        (lambda f, w: ({**f, "algorithm": "dreamer"}, w), "algorithm: expected one of"),
        (lambda f, w: ({**f, "schema": "pendulum_policy/2"}, w), "schema: expected"),
        (lambda f, w: ({**f, "settings": {"gamma": [1]}}, w), "settings.gamma: expected"),
        (lambda f, w: (f, w[:-40]), "expected a policy"),
        (
            lambda f, w: (f, bytes(MOST_BYTES[WEIGHTS] + 1)),
            "weights.safetensors: expected at most",
        ),
        (lambda f, w: ([1, 2], w), "expected a policy"),
    ],
    ids=["nan", "shape", "layers", "algorithm", "schema", "settings", "cut", "bomb", "no facts"],
)
def test_what_does_not_fit_is_refused(tmp_path: Path, learner, change, said: str) -> None:
    save_policy(learner, tmp_path / "policy.zip")
    rewrite(tmp_path / "policy.zip", change)
    with pytest.raises(BadInputError, match=said):
        load_policy(tmp_path / "policy.zip")


@pytest.fixture(scope="module")
def saved(learner, tmp_path_factory) -> bytes:
    file = tmp_path_factory.mktemp("policy") / "policy.zip"
    save_policy(learner, file)
    return file.read_bytes()


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_damage_ends_in_a_sentence_or_the_same_policy(saved, tmp_path_factory, data) -> None:
    """Zip keeps a CRC of every member, so damage is found or lies where nothing is read."""
    content = bytearray(saved)
    if data.draw(st.booleans()):
        content[data.draw(st.integers(0, len(content) - 1))] ^= 1 << data.draw(st.integers(0, 7))
    else:
        content = content[: data.draw(st.integers(0, len(content) - 1))]
    file = tmp_path_factory.mktemp("policy") / "damaged.zip"
    file.write_bytes(content)
    original = file.with_name("whole.zip")
    original.write_bytes(saved)
    try:
        after = collect_tensors(load_policy(file))
    except BadInputError as error:
        assert "expected a policy" in str(error)
    else:
        before = collect_tensors(load_policy(original))
        assert all(torch.equal(before[name], after[name]) for name in before)


def test_old_steps_come_back_in_order(tmp_path: Path) -> None:
    before, after = (as_off_policy(make_trained("sac")) for _ in range(2))
    assert before is not None and after is not None
    before.learn(64, reset_num_timesteps=False)  # 104 steps in a buffer for 64
    save_replay(before, tmp_path / "replay.npz")
    load_replay(after, tmp_path / "replay.npz")
    old, new = before.replay_buffer, after.replay_buffer
    assert new.full and new.pos == 0
    assert np.array_equal(new.rewards, np.roll(old.rewards, -old.pos, axis=0))


def test_a_pickle_in_the_place_of_old_steps_is_not_opened(tmp_path: Path) -> None:
    learner = as_off_policy(make_trained("sac"))
    file = tmp_path / "replay.npz"
    file.write_bytes(pickle.dumps(Trap(tmp_path / "trapped")))
    with pytest.raises(BadInputError, match="remove the file to go on without them"):
        load_replay(learner, file)
    np.savez(file, rewards=np.array([Trap(tmp_path / "trapped")], dtype=object))
    with pytest.raises(BadInputError, match="remove the file"):
        load_replay(learner, file)
    assert not (tmp_path / "trapped").exists()
