"""Make the recordings of the studies of fleets: runs of the twin's kernel with sensors' noise."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import yaml

from pendulum_sysid.reading.bag import write_bag
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

ROOT = Path(__file__).parents[1]
COUNT, RIGS, SECONDS, PERIOD_S = 1000, 10, 20.0, 0.01
BREAK_EVERY = 50  # two in a hundred
CART_NOISE_M, POLE_NOISE_RAD = 5e-5, 1e-3
FIRST_DAY_S, DAY_S = 1_767_598_200, 86_400
CHANGED, CHANGED_DAYS, CALM_DAYS = "changed", 60, 20
CALM = tuple(f"calm_{k:02d}" for k in range(20))  # rigs
SIBLINGS, RECORDINGS_A_SIBLING, SHORT_S = 12, 4, 6.0
VARIED, SIBLING_SPREAD = ("force_per_pwm_n", "cart_viscous_n_s_m", "pole_viscous_n_m_s"), 0.03
HANGING = np.array([0.0, np.pi, 0.0, 0.0])
NOMINAL = load_twin(ROOT / "config" / "inteco.yaml")
TRACKED = replace(
    NOMINAL, effects={"position_scale": {"ratio": 0.0}, "angle_offset": {"angle_rad": 0.0}}
)
TABLE = "table.yaml"  # is written last: a folder without it is not finished


def make_thousand(out: Path) -> Path:
    """Return the folder of 1,000 recordings of ten rigs, two of every hundred broken."""
    folder = out / "thousand"
    if begin_folder(folder):
        for number in range(COUNT):
            bag = folder / "data" / f"rig_{number % RIGS}" / f"{number:04d}"
            write_recording(bag, NOMINAL, number, number // RIGS)
            if number % BREAK_EVERY == 7:
                break_recording(bag, number // BREAK_EVERY % 4)
        write_table(folder, [f"rig_{k}" for k in range(RIGS)], NOMINAL)
    return folder


def link_some(out: Path, rigs: int, recordings: int) -> Path:
    """Return a folder of links to so many recordings of so many rigs of the thousand."""
    thousand, folder = make_thousand(out), out / f"some_{rigs}_{recordings}"
    if begin_folder(folder):
        names = [f"rig_{k}" for k in range(rigs)]
        for rig in names:
            (folder / "data" / rig).mkdir(parents=True)
            for bag in sorted((thousand / "data" / rig).iterdir())[:recordings]:
                (folder / "data" / rig / bag.name).symlink_to(bag.resolve())
        write_table(folder, names, NOMINAL)
    return folder


def make_sixty_days(out: Path) -> Path:
    """Return the folder of a rig that changes three times in 60 days, and of calm rigs."""
    folder = out / "sixty_days"
    if begin_folder(folder):
        for day in range(CHANGED_DAYS):
            bag = folder / "data" / CHANGED / f"day_{day:02d}"
            write_recording(bag, change_rig(day), 5000 + day, day)
        for k, rig in enumerate(CALM):
            for day in range(CALM_DAYS):
                bag = folder / "data" / rig / f"day_{day:02d}"
                write_recording(bag, change_rig(0), 6000 + 100 * k + day, day)
        write_table(folder, [CHANGED, *CALM], TRACKED)
    return folder


def make_siblings(out: Path) -> tuple[Path, dict[str, Twin]]:
    """Return the folder of rigs of one kind with short recordings, and the true rigs."""
    folder, siblings = out / "siblings", draw_siblings()
    if begin_folder(folder):
        for k, (rig, twin) in enumerate(siblings.items()):
            for day in range(RECORDINGS_A_SIBLING):
                bag = folder / "data" / rig / f"day_{day:02d}"
                write_recording(bag, twin, 8000 + 100 * k + day, day, SHORT_S)
        write_table(folder, list(siblings), NOMINAL)
    return folder, siblings


def begin_folder(folder: Path) -> bool:
    """Return whether the recordings are still to be made; what was left half made is removed."""
    if (folder / TABLE).exists():
        return False
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    return True


def change_rig(day: int) -> Twin:
    """Return the rig of a day: friction doubles on 20, belt stretches from 35, encoder on 50."""
    rig = NOMINAL.rig
    if day >= 20:
        assert rig.cart_viscous_n_s_m is not None
        rig = replace(rig, cart_viscous_n_s_m=2.0 * rig.cart_viscous_n_s_m)
    stretched = {"position_scale": {"ratio": -5e-4 * max(day - 34, 0)}}
    turned = {"angle_offset": {"angle_rad": 0.02 if day >= 50 else 0.0}}
    return replace(NOMINAL, rig=rig, effects={**stretched, **turned})


def draw_siblings() -> dict[str, Twin]:
    """Return rigs of one kind, whose drive and frictions differ from rig to rig."""
    rng, siblings = np.random.default_rng(17), {}
    constants = NOMINAL.rig.to_mapping()
    for k in range(SIBLINGS):
        own = {name: constants[name] * (1.0 + SIBLING_SPREAD * rng.normal()) for name in VARIED}
        siblings[f"sibling_{k:02d}"] = replace(NOMINAL, rig=replace(NOMINAL.rig, **own))
    return siblings


def write_recording(bag: Path, twin: Twin, seed: int, day: int, seconds: float = SECONDS) -> None:
    """Write a sine sweep of a twin, which begins on a day."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(seconds / PERIOD_S)) * PERIOD_S
    command = 0.1 * np.sin(2 * np.pi * (rng.uniform(0.3, 0.5) + 0.03 * t) * t)
    n, valid = len(t), np.ones(len(t), bool)
    blank = Signals(PERIOD_S, command, np.zeros(n), np.zeros(n), valid, valid)
    zero = np.zeros(1, dtype=np.int64)
    states = run_freely(blank, make_theta(twin)[None], zero, zero, HANGING[None], n)[0]
    stamps = (FIRST_DAY_S + day * DAY_S) * 10**9 + np.arange(n) * round(PERIOD_S * 1e9)
    joints = {
        "cart": states[:, 0] + rng.normal(0.0, CART_NOISE_M, n),
        "pole": states[:, 1] + rng.normal(0.0, POLE_NOISE_RAD, n),
    }
    write_bag(bag, stamps, joints, command)


def break_recording(bag: Path, how: int) -> None:
    """Break a recording in one of four ways: foreign, a foreign rest, cut off, gone."""
    (file,) = bag.glob("*.mcap")
    content = file.read_bytes()
    if how == 3:
        file.unlink()
    else:
        foreign = f"no recording, but the notes of {bag.name}".encode()
        file.write_bytes((foreign, content[:40] + foreign, content[: len(content) // 3])[how])


def write_table(folder: Path, rigs: list[str], twin: Twin) -> None:
    """Write the twin and the table of the rigs."""
    save_twin(twin, folder / "twin.yaml")
    table = {"schema": "pendulum_fleet/1", "rigs": {rig: {"twin": "twin.yaml"} for rig in rigs}}
    (folder / TABLE).write_text(yaml.safe_dump(table), encoding="utf-8")
