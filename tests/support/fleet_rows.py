"""Rows of a store for tests, and recordings of a fleet."""

import os
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import yaml

from pendulum_sysid.fleet.rows import RIG, RecordingRow, Result, SizeRow
from pendulum_sysid.fleet.work import Work, examine_recording
from pendulum_twin.arrays import Floats
from pendulum_twin.model import save_twin
from support.made_recordings import INTECO, made, made_bag

FIRST_DAY = datetime(2026, 1, 5, 7, 30, tzinfo=UTC)
SIZES = {
    "cart_viscous_n_s_m": (0.5, 0.01, "N s/m"),
    "force_per_pwm_n": (12.86, 0.05, "N"),
    "com_distance_m": (0.0196, 0.0001, "m"),
    "pole_viscous_n_m_s": (2.7e-4, 8e-6, "N m s/rad"),
}  # constant -> value, standard error, unit


def make_result(
    rig: str, day: float, sizes: dict[str, tuple[float, float, str]], **changes: object
) -> Result:
    """Return the rows of a recording on a day, a fit unless `changes` says otherwise.

    sizes: name -> value, standard error and unit; effects are those that a diagnosis named.
    """
    when = FIRST_DAY + timedelta(days=day)
    digest = str(changes.pop("digest", f"sha256:{rig}{day:012.5f}"))
    content = {
        "outcome": "fitted", "sentence": "said", "method": "fit", "twin": "sha256:0",
        "version": "1", "written_at": when, "path": f"/bench/{rig}/day_{day:06.2f}",
    } | changes  # fmt: skip
    rows = tuple(
        SizeRow(rig, digest, *split_name(name), unit, value, value - 1.96 * error,
                value + 1.96 * error, confidence=1.0 if "." in name else float("nan"))
        for name, (value, error, unit) in sizes.items()
    )  # fmt: skip
    return Result(RecordingRow(rig=rig, time=when, digest=digest, **content), rows)


def split_name(name: str) -> tuple[str, str]:
    owner, _, parameter = name.rpartition(".")
    return owner or RIG, parameter


def draw_history(
    rig: str, days: Sequence[float], seed: int, courses: dict[str, Floats] | None = None
) -> list[Result]:
    """Draw the fits of a rig; courses: constant -> its true value on each day."""
    rng = np.random.default_rng(seed)
    results = []
    for k, day in enumerate(days):
        sizes = {}
        for name, (value, error, unit) in SIZES.items():
            true = (courses or {}).get(name, np.full(len(days), value))[k]
            own = error * rng.uniform(0.7, 1.5)
            sizes[name] = (true + own * rng.normal(), own, unit)
        results.append(make_result(rig, day, sizes))
    return results


def write_fleet(folder: Path, count: int = 6, rigs: int = 2, seconds: float = 8.0) -> Path:
    """Write short recordings below folder/data and the table of their rigs; return the table."""
    for number in range(count):
        bag = folder / "data" / f"rig_{number % rigs}" / f"{number:03d}"
        made_bag(bag, made(INTECO, seconds, seed=number + 1))
    save_twin(INTECO, folder / "twin.yaml")
    table = {
        "schema": "pendulum_fleet/1",
        "rigs": {f"rig_{k}": {"twin": "twin.yaml"} for k in range(rigs)},
    }
    (folder / "table.yaml").write_text(yaml.safe_dump(table))
    return folder / "table.yaml"


def examine_or_die(work: Work) -> Result:
    """Examine a recording, but end the worker at the first."""
    if work.source.name.endswith("000"):
        os._exit(9)
    return examine_recording(work)


def examine_growing(work: Work) -> Result:
    """Examine a recording; the first grows meanwhile."""
    if work.source.name.endswith("000"):
        with next(Path(work.source.path).glob("*.mcap")).open("ab") as file:
            file.write(b"more")
    return examine_recording(work)
