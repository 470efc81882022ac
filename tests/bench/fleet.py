"""What docs/fleet.md is measured with; run from the root of the workspace.

python tests/bench/fleet.py record OUT COUNT SECONDS RIGS  recordings of the kernel, 2 % broken
python tests/bench/fleet.py sixty STORE                    60 days, three changes; 20 quiet rigs
python tests/bench/fleet.py quiet SEED REPEATS DAYS        false alarms of quiet histories
python tests/bench/fleet.py pooled                         widths and coverage of pooled sizes
python tests/bench/fleet.py kill SECONDS sysid fleet run ..  SIGKILL a worker every so often
"""

import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import yaml

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.fleet_rows import draw_history
from support.made_recordings import INTECO, made, made_bag

from pendulum_sysid.fleet.changes import count_changes, find_changes
from pendulum_sysid.fleet.pooling import pool_estimates, pool_family
from pendulum_sysid.fleet.store import Store
from pendulum_twin.model import save_twin

DAYS = np.arange(60.0)
COURSES = {
    "cart_viscous_n_s_m": np.where(DAYS < 20, 0.5, 1.0),
    "force_per_pwm_n": 12.86 - 0.06 * np.maximum(DAYS - 34, 0.0),
    "com_distance_m": np.where(DAYS < 50, 0.0196, 0.0206),
}


def record(out: str, count: str, seconds: str, rigs: str) -> None:
    folder, rng = Path(out), np.random.default_rng(1)
    for k in range(int(count)):
        friction = INTECO.rig.cart_viscous_n_s_m * (1.0 + 0.02 * rng.normal())
        twin = replace(INTECO, rig=replace(INTECO.rig, cart_viscous_n_s_m=friction))
        bag = folder / "data" / f"rig_{k % int(rigs):02d}" / f"{k:05d}"
        made_bag(bag, made(twin, float(seconds), seed=k + 1))
        if k % 100 == 37:
            damage_file(next(bag.glob("*.mcap")), k // 100 % 4)
        if k % 100 == 73:
            shutil.rmtree(bag)
            record_useless(bag, float(seconds), k)
    save_twin(INTECO, folder / "twin.yaml")
    table = {f"rig_{k:02d}": {"twin": "twin.yaml"} for k in range(int(rigs))}
    (folder / "table.yaml").write_text(
        yaml.safe_dump({"schema": "pendulum_fleet/1", "rigs": table})
    )


def damage_file(file: Path, how: int) -> None:
    content = file.read_bytes()
    if how == 1:
        file.unlink()
    else:
        file.write_bytes({0: b"", 2: b"garbage" * 1000, 3: content[: len(content) // 50]}[how])


def record_useless(bag: Path, seconds: float, k: int) -> None:
    """Record a rig that stands still, one that runs backwards in time, or one second."""
    recording = made(INTECO, 1.0 if k // 100 % 3 == 2 else seconds, seed=k + 1)
    s = recording.signals
    if k // 100 % 3 == 0:
        s = replace(s, cart=0.0 * s.cart, pole=0.0 * s.pole + np.pi)
    elif k // 100 % 3 == 1:
        s = replace(s, cart=s.cart[::-1].copy(), pole=s.pole[::-1].copy())
    made_bag(bag, replace(recording, signals=s))


def sixty(address: str) -> None:
    store = Store(address)
    store.create()
    with tempfile.TemporaryDirectory() as folder:
        save_twin(INTECO, Path(folder) / "twin.yaml")
        store.write_twin("sha256:0", (Path(folder) / "twin.yaml").read_bytes())
    store.write(draw_history("bench_07", DAYS, 1, COURSES))
    for k in range(20):
        store.write(draw_history(f"quiet_{k:02d}", DAYS, 100 + k))


def quiet(seed: str, repeats: str, days: str) -> None:
    rng, n, sizes = np.random.default_rng(int(seed)), int(days), 5
    for name, draw in (
        ("Gaussian", rng.normal),
        ("Student's t, 4", lambda size: rng.standard_t(4, size)),
    ):
        for spread in (0.0, 1.0):
            alarms = 0
            for _ in range(int(repeats)):
                courses = []
                for _ in range(sizes):
                    errors = rng.uniform(0.5, 2.0, n)
                    values = draw(size=n) * np.hypot(errors, spread)
                    courses.append(find_changes(np.arange(n) * 86400.0, values, errors, sizes))
                alarms += count_changes(courses) > 0
            print(f"{name}, spread {spread:g}, {n} recordings: {alarms} of {repeats} rigs")


def pooled() -> None:
    rng = np.random.default_rng(3)
    print("| rigs | recordings | rig to rig | to recording | alone | true | pooled | true |")
    for count, rigs, between, within in (
        (1, 10, 0.5, 0.0), (3, 10, 0.5, 0.0), (10, 10, 0.5, 0.0), (3, 10, 0.5, 0.5),
        (3, 30, 0.2, 0.2), (3, 10, 0.0, 0.0), (3, 4, 0.5, 0.2),
    ):  # fmt: skip
        alone, together = [], []
        for _ in range(60):
            truths, groups = 10.0 + between * rng.normal(size=rigs), []
            for truth in truths:
                errors = rng.uniform(0.5, 2.0, count)
                scatter = np.hypot(errors, within)
                groups.append((truth + scatter * rng.normal(size=count), errors))
            family = pool_family(groups)
            for truth, rig, group in zip(truths, family.rigs, groups, strict=True):
                own, width = pool_estimates(*group), 2 * 1.96 * np.median(group[1])
                alone.append(((own.high - own.low) / width, own.low <= truth <= own.high))
                together.append(((rig.high - rig.low) / width, rig.low <= truth <= rig.high))
        figures = [
            f"{np.median([w for w, _ in rows]):.2f} | {np.mean([i for _, i in rows]):.1%}"
            for rows in (alone, together)
        ]
        print(f"| {rigs} | {count} | {between} | {within} | {' | '.join(figures)} |")


def kill(every_s: str, *command: str) -> None:
    rng, kills = random.Random(1), 0
    with subprocess.Popen(command, stderr=subprocess.PIPE) as program:
        assert program.stderr is not None
        program.stderr.readline()  # the first recording is done: the workers stand
        os.set_blocking(program.stderr.fileno(), False)
        next_s = time.monotonic() + float(every_s)
        while program.poll() is None:
            program.stderr.read()
            time.sleep(0.1)
            children = psutil.Process(program.pid).children()
            workers = [c for c in children if "spawn_main" in " ".join(c.cmdline())]
            if time.monotonic() > next_s and workers:
                rng.choice(workers).send_signal(signal.SIGKILL)
                kills, next_s = kills + 1, time.monotonic() + float(every_s)
    print(f"{kills} workers killed, exit status {program.returncode}")


if __name__ == "__main__":
    verbs = {"record": record, "sixty": sixty, "quiet": quiet, "pooled": pooled, "kill": kill}
    if len(sys.argv) < 2 or sys.argv[1] not in verbs:
        sys.exit(__doc__)
    verbs[sys.argv[1]](*sys.argv[2:])
