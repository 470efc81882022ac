"""Trials for tests of the proof: made up in memory, or recorded by the twin and sealed as the real ones are."""

import json
from dataclasses import replace
from pathlib import Path

from pendulum_sysid.studies.proof.names import judge_names
from pendulum_sysid.studies.proof.records import (
    Answer,
    HeldOut,
    Judgement,
    NamesJudgement,
    OpenedTrial,
    Size,
    UnlistedEffect,
)
from pendulum_twin.model import save_twin
from support.hidden_physics import hidden
from support.made_recordings import INTECO, made_bag

DRAG = UnlistedEffect("drag_of_third_order", "cart", ("cart_velocity",))


def sealed(
    *effects: str,
    kind: str = "",
    unlisted: tuple[UnlistedEffect, ...] = (),
    name: str = "trial_0000",
) -> OpenedTrial:
    kind = kind or (
        "unlisted" if unlisted else ("nothing", "single", "pair", "triple")[len(effects)]
    )
    return OpenedTrial(
        name=name,
        bag=Path("bag"),
        twin=Path("twin.yaml"),
        kind=kind,
        seed=1,
        pole_counts=4096,
        seconds=60.0,
        closed_loop=False,
        size_factor=1.0,
        effects={name: {} for name in effects},
        rig=INTECO.rig.to_mapping(),
        unlisted=unlisted,
    )


def answer(
    *named: str, outcome: str = "", ties: dict[str, tuple[str, ...]] | None = None, **more: object
) -> Answer:
    outcome = outcome or ("named" if named else "nothing_missing")
    return Answer(outcome, {name: (ties or {}).get(name, ()) for name in named}, **more)


def size(true: float = 1.0, value: float = 1.0, half: float = 0.1, **changes: object) -> Size:
    one = Size(
        "cart_coulomb_friction", "level_n", "N", False, true, value, value - half, value + half
    )
    return replace(one, **changes)


def judgement(
    seal: OpenedTrial, said: Answer, names: NamesJudgement | None = None, **changes: object
) -> Judgement:
    contents = {
        "sizes": (),
        "rig": (),
        "told": (),
        "held_out": HeldOut(100.0, 2.0, 2.0, 1.0),
        "seconds": 10.0,
        "cpu_seconds": 9.0,
    }
    return Judgement(seal, said, names or judge_names(seal, said), **{**contents, **changes})


def recorded(
    folder: Path, effects: dict[str, dict[str, float]], seed: int, seconds: float = 24.0
) -> Path:
    """Write a trial as the program that conceals does, made by the twin."""
    recording, truth = hidden(effects, seed, seconds)
    made_bag(folder / "bag", recording)
    save_twin(INTECO, folder / "twin.yaml")
    seal = {
        "schema": "pendulum_seal/1",
        "effects": effects,
        "unlisted": {},
        "rig": truth.rig.to_mapping(),
    }
    how = {
        "schema": "pendulum_trial/1",
        "kind": ("nothing", "single", "pair", "triple")[len(effects)],
        "seed": seed,
        "pole_counts": 4096,
        "seconds": seconds,
        "closed_loop": False,
        "size_factor": 1.0,
    }
    (folder / "seal.json").write_text(json.dumps(seal))
    (folder / "trial.json").write_text(json.dumps(how))
    return folder
