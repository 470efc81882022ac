"""Machine code: kept for the next process, and nothing but time lost where it cannot be."""

import os
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import pendulum_twin
from pendulum_twin import machine_code
from pendulum_twin.machine_code_files import CheckedFiles, DamagedFileError

SOURCE = Path(pendulum_twin.__file__).parents[1]
TESTS = Path(__file__).parents[1]
KERNEL = """
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
PROBE = "from support.compiled_probe import tell_use; tell_use()"  # same cache, compiled sooner


def start_process(program=PROBE, **environment):
    """Start a program that calls a compiled function and prints its use of the cache."""
    env = (
        os.environ
        | {"PYTHONPATH": f"{SOURCE}{os.pathsep}{TESTS}"}
        | {name: str(value) for name, value in environment.items()}
    )
    return subprocess.Popen(
        [sys.executable, "-c", program], env=env, stdout=subprocess.PIPE, text=True
    )


def read_outcome(started):
    """Return how often a process found machine code, how often it compiled, and its folder."""
    output, _ = started.communicate(timeout=600)
    assert started.returncode == 0
    counts, folder = output.splitlines()
    return tuple(int(n) for n in counts.split()), folder


def test_every_file_with_compiled_functions_is_in_the_digest():
    """Numba keeps a function by its byte code: another constant in its file is not noticed."""
    package = Path(pendulum_twin.__file__).parent
    counted = {path for pattern in machine_code.SOURCES for path in package.glob(pattern)}
    users = {path for path in package.glob("**/*.py") if "compile_cached\n" in path.read_text()}
    assert len(users) >= 7 and users <= counted


def test_a_second_process_compiles_nothing(tmp_path):
    assert read_outcome(start_process(KERNEL, XDG_CACHE_HOME=tmp_path))[0] == (0, 1)
    clone = tmp_path / "clone"  # of the same sources: it finds the code by their content
    shutil.copytree(SOURCE, clone, ignore=shutil.ignore_patterns("__pycache__"))
    counts, folder = read_outcome(start_process(KERNEL, XDG_CACHE_HOME=tmp_path, PYTHONPATH=clone))
    assert counts == (1, 0)
    assert Path(folder).parent == tmp_path / "pendulum_twin"
    assert not stat.S_IMODE(Path(folder).stat().st_mode) & 0o022


def test_processes_at_once_do_not_disturb_each_other(tmp_path):
    started = [start_process(XDG_CACHE_HOME=tmp_path) for _ in range(3)]
    assert len({read_outcome(p)[1] for p in started}) == 1
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path))[0] == (1, 0)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    """Return a cache folder that holds the machine code of one function."""
    folder = tmp_path_factory.mktemp("cache")
    read_outcome(start_process(XDG_CACHE_HOME=folder))
    return folder


def flip_bit(path, at):
    content = bytearray(path.read_bytes())
    content[int(at * (len(content) - 1))] ^= 0x10
    path.write_bytes(content)


def cut(path):
    path.write_bytes(path.read_bytes()[:-100])


@pytest.mark.parametrize(
    ("kind", "damage"),
    [("nbc", lambda path: flip_bit(path, 0.5)), ("nbc", cut), ("nbi", cut)],
    ids=["a flipped bit", "a cut file", "a cut index"],
)
def test_damaged_machine_code_is_compiled_anew(kept, tmp_path, kind, damage):
    shutil.copytree(kept, tmp_path / "cache")
    for path in (tmp_path / "cache").rglob(f"*.{kind}"):
        damage(path)
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path / "cache"))[0] == (0, 1)
    assert read_outcome(start_process(XDG_CACHE_HOME=tmp_path / "cache"))[0] == (1, 0)


def test_no_bit_of_a_file_is_taken_unchecked(tmp_path):
    """A flip anywhere, in the index or the data, is found before anything is unpickled."""
    files = CheckedFiles(tmp_path, "function", (1.0, 2))
    files.save("signature", {"code": bytes(range(256))})
    assert files.load("signature") == {"code": bytes(range(256))}
    for path in sorted(tmp_path.glob("*.nb?")):
        for at in np.linspace(0.0, 1.0, 97):
            flip_bit(path, at)
            with pytest.raises(DamagedFileError):
                files.load("signature")
            flip_bit(path, at)
    assert files.load("signature") == {"code": bytes(range(256))}


def test_machine_code_of_another_function_is_not_taken(tmp_path):
    """Renamed files, as a restored backup or a synchronised home leaves them."""
    files = CheckedFiles(tmp_path, "function", (1.0, 2))
    files.save("one signature", "first")
    files.save("another signature", "second")
    first, second = sorted(tmp_path.glob("*.nbc"))
    content = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(content)
    for signature in ("one signature", "another signature"):
        with pytest.raises(DamagedFileError):
            files.load(signature)


def test_machine_code_of_a_changed_source_is_not_taken(tmp_path):
    CheckedFiles(tmp_path, "function", (1.0, 2)).save("signature", "old")
    assert CheckedFiles(tmp_path, "function", (1.5, 2)).load("signature") is None


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


INTERRUPTED = """
import numba.core.codegen
from pendulum_twin.machine_code import compile_cached


def interrupt(*_):
    raise KeyboardInterrupt


def double(x):
    return 2.0 * x


numba.core.codegen.CPUCodeLibrary._object_compiled_hook = interrupt
try:
    compile_cached(double)(1.0)
except KeyboardInterrupt:
    print("interrupted")
"""


def test_ctrl_c_while_code_is_compiled_is_an_interrupt_and_no_error(tmp_path):
    """Python runs its handler in LLVM's callback, which prints the exception and goes on."""
    environment = os.environ | {"PYTHONPATH": str(SOURCE), "XDG_CACHE_HOME": str(tmp_path)}
    program = tmp_path / "interrupted.py"  # numba keeps no code of a function without a file
    program.write_text(INTERRUPTED)
    done = subprocess.run(
        [sys.executable, str(program)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    assert (done.stdout, done.stderr, done.returncode) == ("interrupted\n", "", 0)
