"""The time of `sysid diagnose` on a minute's recording, from command to report.

The recordings are of emulated rigs: one that conceals nothing, and some that conceal a single
effect. The code of an earlier commit diagnoses the same recordings in turn with the code of today,
in the same run, with the same libraries: so the ratio says what the code did, and not the machine.
Every diagnosis is a process of its own with one thread; bytecode and machine code are compiled and
kept beforehand. Wall times grow with what else the machine does, processor times less. Run as
`python tests/bench/minute.py`.
"""

import argparse
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid.fleet.engine import ONE_THREAD

ROOT = Path(__file__).parents[2]
BEFORE = "03d05952"  # the last commit before rooms, names and the public API were redrawn
EFFECTS = ("input_delay", "cart_coulomb_friction", "belt_backlash", "rail_tilt")
SEED = "77101"
NO_BYTECODE = "PYTHONDONTWRITEBYTECODE"
CLEAN_MARK_S, EFFECT_MARK_S = 6.0, 9.0  # wall


@dataclass(frozen=True)
class Cost:
    """Hold what a diagnosis takes.

    wall_s: from command to report, s.
    cpu_s: processor time, s.
    """

    wall_s: float
    cpu_s: float


def main() -> None:
    """Print the table, a row as soon as it is measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", default=BEFORE, help="commit of the earlier code")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--effects", nargs="*", default=EFFECTS)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder)
        trees = (ROOT, take_earlier_code(options.before, place / "before"))
        print(
            "| concealed | wall s | mark | before: wall s | wall, ratio | CPU s "
            "| before: CPU s | CPU, ratio |\n"
            "| :--- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |",
            flush=True,
        )
        for effect in ("nothing", *options.effects):
            trial = record_trial(place / effect, effect)
            print(measure_row(trial, trees, options.repeats), flush=True)


def take_earlier_code(commit: str, folder: Path) -> Path:
    """Return the folder with the packages as they were at a commit."""
    folder.mkdir()
    archive = subprocess.run(
        ["git", "-C", ROOT, "archive", commit, "src"], stdout=subprocess.PIPE, check=True
    )
    subprocess.run(["tar", "-x", "-C", folder], input=archive.stdout, check=True)
    return folder


def record_trial(folder: Path, effect: str) -> Path:
    """Return the folder of a trial: a minute's recording, and the nominal twin."""
    concealed = ("--kinds", "nothing:1") if effect == "nothing" else ("--effects", effect)
    options = ("--out", str(folder), "--trials", "1", "--seed", SEED, "--quiet", *concealed)
    run(ROOT, "pendulum_bridge.studies.trials", options)
    return folder / "trial_0000"


def measure_row(trial: Path, trees: Sequence[Path], repeats: int) -> str:
    """Return a row of the table: the medians of both codes, which take turns."""
    for tree in trees:
        diagnose(tree, trial)  # compile, fill caches
    turns = [[diagnose(tree, trial) for tree in trees] for _ in range(repeats)]
    now, before = (
        Cost(
            statistics.median(cost.wall_s for cost in costs),
            statistics.median(cost.cpu_s for cost in costs),
        )
        for costs in zip(*turns, strict=True)
    )
    concealed = trial.parent.name
    mark = CLEAN_MARK_S if concealed == "nothing" else EFFECT_MARK_S
    return (
        f"| {concealed} | {now.wall_s:.1f} | {mark:.0f} | {before.wall_s:.1f} "
        f"| {before.wall_s / now.wall_s:.2f} | {now.cpu_s:.1f} | {before.cpu_s:.1f} "
        f"| {before.cpu_s / now.cpu_s:.2f} |"
    )


def diagnose(tree: Path, trial: Path) -> Cost:
    """Return what a diagnosis with report takes in a process of its own."""
    out = trial / "diagnosis"
    began, used = time.monotonic(), sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    options = ("diagnose", trial / "bag", "--twin", trial / "twin.yaml", "--out", out)
    run(tree, "pendulum_sysid.cli", options)
    ended = sum(resource.getrusage(resource.RUSAGE_CHILDREN)[:2])
    return Cost(time.monotonic() - began, ended - used)


def run(tree: Path, module: str, options: Sequence[str | Path]) -> None:
    """Run a module of the packages of a tree, silently."""
    packages = os.pathsep.join(str(path.parent) for path in (tree / "src").glob("*/setup.py"))
    inherited = {name: value for name, value in os.environ.items() if name != NO_BYTECODE}
    subprocess.run(
        [sys.executable, "-m", module, *options],
        env={**inherited, **ONE_THREAD, "PYTHONPATH": packages},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        check=True,
    )


if __name__ == "__main__":
    main()
