"""Trials for tests of the proof: made in memory, or recorded by the twin and sealed."""

import json
from dataclasses import replace
from pathlib import Path

from pendulum_sysid.studies.proof.names import judge_names
from pendulum_sysid.studies.proof.records import (
    HeldOut,
    Judgement,
    OpenedTrial,
    Seal,
    Size,
    TrialAnswer,
    UnlistedEffect,
)
from pendulum_twin.model import save_twin
from support.hidden_physics import record_hidden
from support.made_recordings import INTECO, made_bag

DRAG = UnlistedEffect("drag_of_third_order", "cart", ("cart_velocity",))
KINDS = ("nothing", "single", "pair", "triple")


def make_seal(*effects: str, unlisted: tuple[UnlistedEffect, ...] = ()) -> Seal:
    return Seal({name: {} for name in effects}, INTECO.rig.to_mapping(), unlisted)


def make_trial(
    *effects: str, unlisted: tuple[UnlistedEffect, ...] = (), **changes: object
) -> OpenedTrial:
    trial = OpenedTrial(
        name="trial_0000",
        bag=Path("bag"),
        twin=Path("twin.yaml"),
        kind="unlisted" if unlisted else KINDS[len(effects)],
        seed=1,
        pole_counts=4096,
        seconds=60.0,
        closed_loop=False,
        size_factor=1.0,
        seal=make_seal(*effects, unlisted=unlisted),
    )
    return replace(trial, **changes)


def make_answer(
    *named: str, outcome: str = "", ties: dict[str, tuple[str, ...]] | None = None, **more: object
) -> TrialAnswer:
    outcome = outcome or ("named" if named else "nothing_missing")
    return TrialAnswer(outcome, {name: (ties or {}).get(name, ()) for name in named}, **more)


def make_size(true: float = 1.0, value: float = 1.0, half: float = 0.1, **changes: object) -> Size:
    size = Size(
        "cart_coulomb_friction", "level_n", "N", False, true, value, value - half, value + half
    )
    return replace(size, **changes)


def make_judgement(trial: OpenedTrial, answer: TrialAnswer, **changes: object) -> Judgement:
    contents = {
        "names": judge_names(trial.seal, answer),
        "sizes": (),
        "rig": (),
        "oracle": (),
        "held_out": HeldOut(100.0, 2.0, 2.0, 1.0),
        "seconds": 10.0,
        "cpu_seconds": 9.0,
    }
    return Judgement(trial, answer, **{**contents, **changes})


def write_trial(
    folder: Path,
    effects: dict[str, dict[str, float]],
    seed: int,
    seconds: float = 24.0,
    other: bool = False,
) -> Path:
    """Write a trial as the recorder of trials does; the twin is the rig.

    other: whether the rig is recorded a second time, moved by another command.
    """
    recording, truth = record_hidden(effects, seed, seconds)
    made_bag(folder / "bag", recording)
    if other:
        made_bag(folder / "other", record_hidden(effects, seed, seconds, seed + 100)[0])
    save_twin(INTECO, folder / "twin.yaml")
    seal = {
        "schema": "pendulum_seal/1",
        "effects": effects,
        "unlisted": {},
        "rig": truth.rig.to_mapping(),
    }
    trial = {
        "schema": "pendulum_trial/1",
        "kind": KINDS[len(effects)],
        "seed": seed,
        "pole_counts": 4096,
        "seconds": seconds,
        "closed_loop": False,
        "size_factor": 1.0,
    }
    (folder / "seal.json").write_text(json.dumps(seal))
    (folder / "trial.json").write_text(json.dumps(trial))
    return folder
