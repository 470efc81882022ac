"""Measure what `docs/fleet.md` says of many recordings: scaling, kills, another cluster, history.

Run as `python docs/study_fleet.py OUT [STUDY ...]`; OUT gets recordings and stores. The
recordings are runs of the twin's kernel with the noise of sensors.
"""

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
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from pendulum_sysid.fleet.history import describe_history, read_histories
from pendulum_sysid.fleet.pooling import DEVIATIONS, pool_estimates, pool_family
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.reading.bag import write_bag
from pendulum_twin.free_runs import run_freely
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parameter_vector import make_theta
from pendulum_twin.signals import Signals

ROOT = Path(__file__).parents[1]
COUNT, RIGS, SECONDS, PERIOD_S = 1000, 10, 20.0, 0.01
DIAGNOSED_A_RIG = 4  # recordings of the study of diagnoses
BREAK_EVERY = 50  # two in a hundred
CART_NOISE_M, POLE_NOISE_RAD = 5e-5, 1e-3
FIRST_DAY_S, DAY_S = 1_767_598_200, 86_400
BY_CHANCE = ["written_at", "batch", "cpu_s"]  # columns that differ from run to run
FIT = ("--method", "fit")
CALM_DAYS, CALM_RIGS = 20, 20
SIBLINGS, RECORDINGS_A_SIBLING, SHORT_S = 12, 4, 6.0
VARIED, SIBLING_SPREAD = ("force_per_pwm_n", "cart_viscous_n_s_m", "pole_viscous_n_m_s"), 0.03
HANGING = np.array([0.0, np.pi, 0.0, 0.0])
NOMINAL = load_twin(ROOT / "config" / "inteco.yaml")
TRACKED = replace(
    NOMINAL, effects={"position_scale": {"ratio": 0.0}, "angle_offset": {"angle_rad": 0.0}}
)


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
    (folder / "table.yaml").write_text(yaml.safe_dump(table), encoding="utf-8")


def make_fleet(out: Path) -> Path:
    """Return the folder of 1,000 recordings of ten rigs, two of every hundred broken."""
    folder = out / "thousand"
    if (folder / "table.yaml").exists():
        return folder
    for number in range(COUNT):
        bag = folder / "data" / f"rig_{number % RIGS}" / f"{number:04d}"
        write_recording(bag, NOMINAL, number, number // RIGS)
        if number % BREAK_EVERY == 7:
            break_recording(bag, number // BREAK_EVERY % 4)
    write_table(folder, [f"rig_{k}" for k in range(RIGS)], NOMINAL)
    return folder


def start(folder: Path, store: Path, *more: str) -> subprocess.Popen[str]:
    """Start `sysid fleet run --method fit` in its own process group; `more` has the last word."""
    words = [str(folder / "data"), "--twins", str(folder / "table.yaml"), "--store", str(store)]
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
    store = out / "store_calm"
    if not store.exists():
        run(make_fleet(out), store, "--workers", "2")
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
    compare_workers(make_fleet(out), out / "scaling")


def study_diagnoses(out: Path) -> None:
    """Print how much faster two workers diagnose than one, on some of the recordings."""
    folder, few = make_fleet(out), out / "few"
    for rig in sorted((folder / "data").iterdir()):
        (few / "data" / rig.name).mkdir(parents=True, exist_ok=True)
        for bag in sorted(rig.iterdir())[:DIAGNOSED_A_RIG]:
            link = few / "data" / rig.name / bag.name
            if not link.exists():
                link.symlink_to(bag.resolve())
    for name in ("table.yaml", "twin.yaml"):
        shutil.copyfile(folder / name, few / name)
    compare_workers(few, out / "diagnoses", "--method", "diagnose")


def compare_workers(folder: Path, stores: Path, *more: str) -> None:
    """Run a fleet with two workers, with one, and with two again; print times and rows.

    The runs with two workers stand around the run with one: a computer that becomes faster or
    slower meanwhile shows in their difference.
    """
    shutil.rmtree(stores, ignore_errors=True)
    seconds: dict[int, list[float]] = {1: [], 2: []}
    for number, workers in enumerate((2, 1, 2)):
        store = stores / str(number)
        seconds[workers].append(run(folder, store, "--workers", str(workers), *more))
        frame = Store(str(store)).read_recordings()
        work, took = float(frame["cpu_s"].sum()), seconds[workers][-1]
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


def list_workers(group: int) -> list[int]:
    """Return the worker processes of a process group: those that Dask's nannies spawned."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = status.read_text().rsplit(")", 1)[1].split()
            command = (status.parent / "cmdline").read_bytes()
        except OSError:
            continue
        if int(fields[2]) == group and b"spawn_main" in command:
            found.append(int(status.parent.name))
    return found


def study_kills(out: Path) -> None:
    """Kill a worker every 20 s, and print what the store then holds."""
    open_calm_store(out)
    folder, store = make_fleet(out), name_new_store(out, "store_kills")
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
    folder, store = make_fleet(out), name_new_store(out, "store_coordinator")
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
    folder, store = make_fleet(out), name_new_store(out, "store_cluster")
    with open_cluster(out) as address:
        run(folder, store, "--scheduler", address)
    print(f"  {describe_differences(store, open_calm_store(out))}")


def change_rig(day: int) -> Twin:
    """Return the rig of a day: friction doubles on 20, belt stretches from 35, encoder on 50."""
    rig = NOMINAL.rig
    if day >= 20:
        assert rig.cart_viscous_n_s_m is not None
        rig = replace(rig, cart_viscous_n_s_m=2.0 * rig.cart_viscous_n_s_m)
    stretched = {"position_scale": {"ratio": -5e-4 * max(day - 34, 0)}}
    turned = {"angle_offset": {"angle_rad": 0.02 if day >= 50 else 0.0}}
    return replace(NOMINAL, rig=rig, effects={**stretched, **turned})


def study_history(out: Path) -> None:
    """Print what a history of 60 days with three changes, and those of quiet rigs, say."""
    folder = out / "sixty_days"
    calm = [f"calm_{k:02d}" for k in range(CALM_RIGS)]
    if not (folder / "table.yaml").exists():
        for day in range(60):
            bag = folder / "data" / "changed" / f"day_{day:02d}"
            write_recording(bag, change_rig(day), 5000 + day, day)
        for k, rig in enumerate(calm):
            for day in range(CALM_DAYS):
                bag = folder / "data" / rig / f"day_{day:02d}"
                write_recording(bag, change_rig(0), 6000 + 100 * k + day, day)
        write_table(folder, ["changed", *calm], TRACKED)
    store = name_new_store(out, "store_history")
    run(folder, store, "--workers", "2")
    histories = read_histories(Store(str(store)))
    for history in histories:
        if history.rig == "changed":
            print("  " + "\n  ".join(describe_history(history)))
    alarms = [h.rig for h in histories if h.rig in calm and (h.changes or h.drifts)]
    print(f"  {len(calm)} quiet rigs: {len(alarms)} with a change {alarms}")


def draw_siblings() -> dict[str, Twin]:
    """Return rigs of one kind, whose drive and frictions differ from rig to rig."""
    rng, siblings = np.random.default_rng(17), {}
    constants = NOMINAL.rig.to_mapping()
    for k in range(SIBLINGS):
        own = {name: constants[name] * (1.0 + SIBLING_SPREAD * rng.normal()) for name in VARIED}
        siblings[f"sibling_{k:02d}"] = replace(NOMINAL, rig=replace(NOMINAL.rig, **own))
    return siblings


def study_pooling(out: Path) -> None:
    """Print how much sharper pooled intervals are, and how often they hold the truth.

    Every rig has a few recordings of 6 s. A recording alone, the rig's recordings pooled, and the
    rig among its siblings are compared.
    """
    folder, siblings = out / "siblings", draw_siblings()
    if not (folder / "table.yaml").exists():
        for k, (rig, twin) in enumerate(siblings.items()):
            for day in range(RECORDINGS_A_SIBLING):
                bag = folder / "data" / rig / f"day_{day:02d}"
                write_recording(bag, twin, 8000 + 100 * k + day, day, SHORT_S)
        write_table(folder, list(siblings), NOMINAL)
    store = name_new_store(out, "store_siblings")
    run(folder, store, "--workers", "2")
    sizes = Store(str(store)).read_sizes()
    for name in VARIED:
        groups, truths = [], []
        for rig, group in sizes[sizes["parameter"] == name].groupby("rig"):
            errors = (group["high"] - group["low"]).to_numpy() / (2 * DEVIATIONS)
            groups.append((group["value"].to_numpy(), errors))
            truths.append(siblings[rig].rig.to_mapping()[name])
        alone = [
            (v - DEVIATIONS * e, v + DEVIATIONS * e, truth)
            for (values, errors), truth in zip(groups, truths, strict=True)
            for v, e in zip(values, errors, strict=True)
        ]
        own = [pool_estimates(*group) for group in groups]
        pooled, among = (
            [(p.low, p.high, truth) for p, truth in zip(rigs, truths, strict=True)]
            for rigs in (own, pool_family(groups).rigs)
        )
        words = (describe_intervals(rows) for rows in (alone, pooled, among))
        print(f"  {name}: " + "; ".join(words))


def describe_intervals(rows: list[tuple[float, float, float]]) -> str:
    """Tell the median half width of intervals, in per cent of the truth, and how many hold it."""
    half = np.median([(high - low) / 2 / truth for low, high, truth in rows])
    inside = sum(low <= truth <= high for low, high, truth in rows)
    return f"+-{100 * half:.2g} %, {inside} of {len(rows)} hold the truth"


STUDIES: dict[str, Callable[[Path], None]] = {
    "scaling": study_scaling,
    "diagnoses": study_diagnoses,
    "kills": study_kills,
    "coordinator": study_coordinator,
    "cluster": study_cluster,
    "history": study_history,
    "pooling": study_pooling,
}


def main() -> None:
    """Run the studies that are named, or all."""
    out, *wanted = sys.argv[1:]
    Path(out).mkdir(parents=True, exist_ok=True)
    for name in wanted or STUDIES:
        print(name, flush=True)
        STUDIES[name](Path(out))


if __name__ == "__main__":
    main()
