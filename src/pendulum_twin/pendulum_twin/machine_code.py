"""Compile for the processor at hand, and keep the machine code from one process to the next.

Kept in the user's cache folder, or else in a folder of the user's own among the temporary files,
or else not at all: a program then compiles each time, which takes seconds, and says nothing.
"""

from __future__ import annotations

import contextlib
import fcntl
import functools
import hashlib
import os
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numba
from numba.core.caching import FunctionCache

from pendulum_twin.machine_code_files import CheckedFiles
from pendulum_twin.user_effects import list_effect_files

HERE = Path(__file__).parent
# All files that go into compiled functions. Numba keeps a function by its byte code, and notices
# no other change.
SOURCES = (
    "block.py",
    "compose.py",
    "compose_reactions.py",
    "compose_rows.py",
    "elementary.py",
    "equations.py",
    "held_laws.py",
    "hysteresis.py",
    "inverse_dynamics.py",
    "kernel.py",
    "law_curves.py",
    "lanes.py",
    "machine_code.py",
    "motion.py",
    "parameter_vector.py",
    "path_memory.py",
    "placing.py",
    "reactions.py",
    "sensors.py",
    "stages.py",
    "stick_slip.py",
    "effects/*.py",
    "laws/*.py",
)

LOST_CODE = "no compiled object yet"  # numba's complaint where its callback did not end


def compile_cached(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function when it is first called, or take its machine code from the cache."""
    return make_cached_compiler()(function)


def make_cached_compiler(*more: Path) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return `compile_cached` for functions that more source files go into, of another package."""
    return lambda function: _compile(function, find_cache_folder(more))


def _compile(function: Callable[..., Any], folder: Path | None) -> Callable[..., Any]:
    """Return a compiled function that keeps its machine code in a folder, or nowhere."""
    _silence_lost_interrupts()
    result = numba.njit(error_model="numpy", nogil=True)(function)
    if folder is not None:
        before = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(folder)
        try:
            result._cache = _SharedCache(function, folder)
        finally:
            numba.config.CACHE_DIR = before
    return result


@functools.cache
def _silence_lost_interrupts() -> None:
    """Print no traceback of Ctrl-C in a callback of LLVM: `save_overload` raises it once more."""
    report = sys.unraisablehook

    def report_others(lost: Any) -> None:
        in_callback = "ctypes callback" in (lost.err_msg or "")
        if not (in_callback and issubclass(lost.exc_type, KeyboardInterrupt)):
            report(lost)

    sys.unraisablehook = report_others


@functools.cache
def find_cache_folder(more: tuple[Path, ...] = ()) -> Path | None:
    """Return the folder for machine code, named by its sources' digest; None for no place."""
    digest = hashlib.sha256()
    own = sorted(path for pattern in SOURCES for path in HERE.glob(pattern))
    for path in [*own, *list_effect_files(), *more]:
        digest.update(path.read_bytes())
    for root in _list_roots():
        folder = root / "pendulum_twin" / digest.hexdigest()[:16]
        if _is_ours(folder):
            return folder
    return None


def _list_roots() -> Iterator[Path]:
    """Yield the folders in which machine code may be kept, the preferred folder first."""
    if "XDG_CACHE_HOME" in os.environ:
        yield Path(os.environ["XDG_CACHE_HOME"])
    with contextlib.suppress(RuntimeError):  # no home
        yield Path.home() / ".cache"
    with contextlib.suppress(OSError):  # no place for temporary files
        root = Path(tempfile.gettempdir()) / f"pendulum_twin-{os.getuid()}"
        if _is_ours(root):
            yield root


def _is_ours(folder: Path) -> bool:
    """Return whether only this user can write to a folder, made if need be: code runs from it."""
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            status = folder.stat()
            return status.st_uid == os.getuid() and not status.st_mode & 0o022
    except OSError:
        return False


class _SharedCache(FunctionCache):
    """Share a cache among processes; what cannot be read, or is damaged, is compiled anew."""

    def __init__(self, function: Callable[..., Any], folder: Path) -> None:
        super().__init__(function)
        # the folder's name is the digest of all sources: any clone of them finds the code here
        self._cache_file = CheckedFiles(folder, self._impl.filename_base, folder.name)
        self._lock_path = folder / "lock"

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        try:
            return super().load_overload(sig, target_context)
        except Exception:  # the digests fit only what was written: forget all of this function
            with contextlib.suppress(OSError), self._lock():
                self.flush()
            return None

    def save_overload(self, sig: Any, data: Any) -> None:
        """Keep the code; raise the KeyboardInterrupt that a callback of LLVM had to swallow."""
        try:
            with contextlib.suppress(OSError), self._lock():  # no space left: compiled next time
                super().save_overload(sig, data)
        except RuntimeError as error:
            if LOST_CODE not in str(error):
                raise
            raise KeyboardInterrupt from error

    @contextlib.contextmanager
    def _lock(self) -> Iterator[None]:
        """Keep other processes out: an index is read and written in two steps."""
        with self._lock_path.open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            yield
