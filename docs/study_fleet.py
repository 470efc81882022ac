"""Measure what `docs/fleet.md` says of the engine: scaling, kills, another cluster."""

from __future__ import annotations

import os
import random
import resource
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pandas as pd
import yaml
from fleet_recordings import RIGS, TABLE, link_some, make_thousand
from program_options import make_parser

from pendulum_sysid.fleet.store import Store
from pendulum_twin.command_line import run_command

DIAGNOSED_A_RIG = 4  # recordings of the study of diagnoses
BY_CHANCE = ["written_at", "batch", "cpu_s"]  # columns that differ from run to run
FIT = ("--method", "fit")
CALM_STORE = "store_calm"


def start(folder: Path, store: Path, *more: str) -> subprocess.Popen[str]:
    """Start `sysid fleet run --method fit` in its own process group; `more` has the last word."""
    words = [str(folder / "data"), "--twins", str(folder / TABLE), "--store", str(store)]
    return subprocess.Popen(
        [sys.executable, "-m", "pendulum_sysid.cli", "fleet", "run", *words, *FIT, *more],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        start_new_session=True,
    )


def run(folder: Path, store: Path, *more: str) -> float:
    """Run the fleet to its end, print what it says, and return the seconds that it took."""
    began = time.monotonic()
    with start(folder, store, *more) as program:
        assert program.stdout is not None
        said = program.stdout.read().strip().splitlines()
    seconds = time.monotonic() - began
    print(
        f"  {' '.join(more)}: {seconds:.1f} s; {said[-1] if said else 'nothing said'}", flush=True
    )
    return seconds


def read(store: Path) -> pd.DataFrame:
    """Return the rows of a store without what differs from run to run."""
    return Store(str(store)).read_recordings().drop(columns=BY_CHANCE)


def name_new_store(out: Path, name: str) -> Path:
    """Return the place of a store; what an earlier study left there is removed."""
    shutil.rmtree(out / name, ignore_errors=True)
    return out / name


def open_calm_store(out: Path) -> Path:
    """Return the store of a run that nothing disturbs."""
    store = out / CALM_STORE
    if not store.exists():
        run(make_thousand(out), store, "--workers", "2")
    return store


def describe_differences(store: Path, other: Path) -> str:
    """Tell how the rows and sizes of two stores differ."""
    rows, others = read(store), read(other)
    sizes, other_sizes = (Store(str(place)).read_sizes() for place in (store, other))
    same = rows.equals(others) and sizes.equals(other_sizes)
    twice = int(rows.duplicated(["rig", "digest"]).sum())
    return f"{len(rows)} rows, {twice} twice, {'equal' if same else 'NOT equal'} to the other run"


def study_scaling(out: Path) -> None:
    """Print how much faster two workers fit than one, and what the engine costs."""
    one_recording = link_some(out, 1, 1)
    start_s = run(one_recording, name_new_store(out, "store_start"), "--workers", "1")
    work_s, took_s = compare_workers(make_thousand(out), out / "scaling")
    share = (took_s - start_s - work_s) / (took_s - start_s)
    print(f"  beyond a start of {start_s:.1f} s, {share:.1%} of one worker's time is no task")


def study_diagnoses(out: Path) -> None:
    """Print how much faster two workers diagnose than one, on some of the recordings."""
    some = link_some(out, RIGS, DIAGNOSED_A_RIG)
    compare_workers(some, out / "diagnoses", "--method", "diagnose")


def compare_workers(folder: Path, stores: Path, *more: str) -> tuple[float, float]:
    """Run a fleet with two workers, with one, and with two again; print times and rows.

    Returns the work of all tasks and the whole time with one worker, s.

    The runs with two workers stand around the run with one: a computer that becomes faster or
    slower meanwhile shows in their difference.
    """
    shutil.rmtree(stores, ignore_errors=True)
    seconds: dict[int, list[float]] = {1: [], 2: []}
    works: dict[int, float] = {}
    for number, workers in enumerate((2, 1, 2)):
        store = stores / str(number)
        seconds[workers].append(run(folder, store, "--workers", str(workers), *more))
        frame = Store(str(store)).read_recordings()
        work, took = float(frame["cpu_s"].sum()), seconds[workers][-1]
        works[workers] = work
        share = 1.0 - work / (workers * took)
        print(
            f"  {workers} workers: {work:.0f} s of CPU in tasks, {share:.1%} of the time in none"
        )
        print(f"  outcomes {frame['outcome'].value_counts().to_dict()}")
        size = sum(file.stat().st_size for file in store.rglob("*") if file.is_file())
        print(f"  store: {size / len(frame):.0f} bytes a recording")
    ratios = [seconds[1][0] / two for two in seconds[2]]
    print(f"  two workers against one: {ratios[0]:.2f} and {ratios[1]:.2f} times")
    print(f"  equal: {describe_differences(stores / '0', stores / '1')}")
    peak_kib = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"  largest process: {peak_kib / 1024:.0f} MiB")
    return works[1], seconds[1][0]


def list_workers(group: int) -> list[int]:
    """Return the worker processes of a process group: those that Dask's nannies spawned."""
    workers = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rsplit(")", 1)[1].split()
            command = (status.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(fields[2]) == group and b"spawn_main" in command:
            workers.append(int(status.parent.name))
    return workers


def study_kills(out: Path) -> None:
    """Kill a worker every 20 s, and print what the store then holds."""
    open_calm_store(out)
    folder, store = make_thousand(out), name_new_store(out, "store_kills")
    ended, kills = threading.Event(), []
    program = start(folder, store, "--workers", "2")

    def kill() -> None:
        while not ended.wait(20.0):
            workers = list_workers(program.pid)
            if workers:
                kills.append(random.choice(workers))
                os.kill(kills[-1], signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    output, _ = program.communicate()
    ended.set()
    thread.join()
    print(f"  {len(kills)} workers killed; {output.strip().splitlines()[0]}")
    print(f"  {describe_differences(store, open_calm_store(out))}")


def study_coordinator(out: Path) -> None:
    """Kill the coordinator and all workers twice, run again, and compare the store."""
    folder, store = make_thousand(out), name_new_store(out, "store_coordinator")
    for pause_s in (45.0, 45.0):
        program = start(folder, store, "--workers", "2")
        try:
            program.wait(pause_s)
        except subprocess.TimeoutExpired:
            os.killpg(program.pid, signal.SIGKILL)
            program.wait()
        print(f"  killed with {len(read(store))} rows in the store")
    run(folder, store, "--workers", "2")
    print(f"  {describe_differences(store, open_calm_store(out))}")


@contextmanager
def open_cluster(out: Path) -> Iterator[str]:
    """Give the address of a scheduler with two workers, each a process of its own."""
    file = out / "scheduler.json"
    file.unlink(missing_ok=True)
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    dask = [sys.executable, "-m", "dask"]
    scheduler = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"]
    worker = ["worker", "--nthreads", "1", "--no-dashboard"]
    processes = [
        subprocess.Popen([*dask, *words, "--scheduler-file", str(file)], **quiet)
        for words in (scheduler, worker, worker)
    ]
    try:
        while not file.is_file() or "tcp://" not in file.read_text(encoding="utf-8"):
            time.sleep(0.1)
        yield yaml.safe_load(file.read_text(encoding="utf-8"))["address"]
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def study_cluster(out: Path) -> None:
    """Run on scheduler and workers that are processes of their own, over TCP."""
    folder, store = make_thousand(out), name_new_store(out, "store_cluster")
    with open_cluster(out) as address:
        run(folder, store, "--scheduler", address)
    print(f"  {describe_differences(store, open_calm_store(out))}")


STUDIES: dict[str, Callable[[Path], None]] = {
    "scaling": study_scaling,
    "diagnoses": study_diagnoses,
    "kills": study_kills,
    "coordinator": study_coordinator,
    "cluster": study_cluster,
}


def parse_arguments(
    program: str,
    description: str | None,
    studies: Mapping[str, Callable[[Path], None]],
    arguments: Sequence[str] | None,
) -> tuple[Path, list[str]]:
    """Return the folder for what is made, and the studies that are chosen, by default all."""
    first = next(iter(studies))
    parser = make_parser(program, description, "out/fleet_study", f"out/fleet_study {first}")
    add, every = parser.add_argument, "by default all: %(choices)s"
    add("out", type=Path, metavar="OUT", help="folder for recordings and stores")
    add("studies", nargs="*", metavar="STUDY", choices=list(studies), help=every)
    given = parser.parse_args(arguments)
    return given.out, given.studies or list(studies)


def run_studies(
    program: str, out: Path, chosen: Sequence[str], studies: Mapping[str, Callable[[Path], None]]
) -> int:
    """Run the chosen studies; return the exit status."""

    def run_each() -> None:
        out.mkdir(parents=True, exist_ok=True)
        for name in chosen:
            print(name, flush=True)
            studies[name](out)

    return run_command(program, run_each, f"{out} holds what was made until then")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the studies; the calm run that they compare with is of the same code."""
    out, chosen = parse_arguments("study_fleet", __doc__, STUDIES, arguments)
    name_new_store(out, CALM_STORE)
    return run_studies("study_fleet", out, chosen, STUDIES)


if __name__ == "__main__":
    sys.exit(main())
