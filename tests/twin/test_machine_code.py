"""Machine code: kept for the next process, and nothing but time lost where it cannot be."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import pendulum_twin

SOURCE = Path(pendulum_twin.__file__).parents[1]
PROGRAM = """
import numpy as np
from pendulum_twin import kernel, machine_code
from pendulum_twin.compose import compute_memory_sizes
offsets = np.concatenate([[0], np.cumsum(compute_memory_sizes(1e-3))]).astype(np.int64)
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.parameter_vector import NEUTRAL
off, out = np.zeros(len(CATALOGUE), dtype=bool), np.empty(30)
drive = kernel.filter_command  # it compiles faster than the mechanics
drive(np.ones(3), np.zeros(offsets[-1]), offsets, 1e-3, 10, 0, NEUTRAL.copy(), off, out)
assert np.all(out == 1.0)
print(sum(drive.stats.cache_hits.values()), sum(drive.stats.cache_misses.values()))
print(machine_code.find_cache_folder())
"""


def start_process(**environment):
    """Start a program that filters a command and prints its use of the cache."""
    env = (
        os.environ
        | {"PYTHONPATH": str(SOURCE)}
        | {name: str(value) for name, value in environment.items()}
    )
    return subprocess.Popen(
        [sys.executable, "-c", PROGRAM], env=env, stdout=subprocess.PIPE, text=True
    )


def read_outcome(started):
    """Return how often a process found machine code, how often it compiled, and its folder."""
    output, _ = started.communicate(timeout=600)
    assert started.returncode == 0
    counts, folder = output.splitlines()
    return tuple(int(n) for n in counts.split()), folder


def test_a_second_process_compiles_nothing(tmp_path):
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path))[0] == (0, 1)
    counts, folder = read_outcome(start_process(XDG_CACHE_HOME=tmp_path))
    assert counts == (1, 0)
    assert Path(folder).parent == tmp_path / "pendulum_twin"
    assert not stat.S_IMODE(Path(folder).stat().st_mode) & 0o022


def test_processes_at_once_do_not_disturb_each_other(tmp_path):
    started = [start_process(XDG_CACHE_HOME=tmp_path) for _ in range(3)]
    assert len({read_outcome(p)[1] for p in started}) == 1
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path))[0] == (1, 0)


@pytest.mark.parametrize("kind", ["nbi", "nbc"])
def test_damaged_files_are_made_anew(tmp_path, kind):
    read_outcome(start_process(XDG_CACHE_HOME=tmp_path))
    damaged = list(tmp_path.rglob(f"*.{kind}"))
    assert damaged
    for path in damaged:
        path.write_bytes(b"damaged")
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path))[0] == (0, 1)
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path))[0] == (1, 0)


def test_without_a_writable_home_it_goes_among_the_temporary_files(tmp_path):
    nowhere = "/proc/nowhere"
    _, folder = read_outcome(start_process(XDG_CACHE_HOME=nowhere, HOME=nowhere, TMPDIR=tmp_path))
    assert Path(folder).is_relative_to(tmp_path)
    assert stat.S_IMODE((tmp_path / f"pendulum_twin-{os.getuid()}").stat().st_mode) == 0o700


def test_a_folder_that_others_may_write_is_not_trusted(tmp_path):
    (tmp_path / f"pendulum_twin-{os.getuid()}").mkdir(mode=0o777)
    (tmp_path / f"pendulum_twin-{os.getuid()}").chmod(0o777)
    _, folder = read_outcome(
        start_process(XDG_CACHE_HOME="/proc/nowhere", HOME="/proc/nowhere", TMPDIR=tmp_path)
    )
    assert folder == "None"
