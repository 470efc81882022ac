"""Keep machine code in files that are checked before anything is taken from them.

A file of machine code is named by the digest of its content, and an index holds its own digest: a
flipped bit, a cut file or a file of another function would otherwise run as code and end the
process by a signal (SIGSEGV, SIGABRT).
"""

from __future__ import annotations

import hashlib
import pickle
from pathlib import Path
from typing import Any

import numba
from numba.core.serialize import dumps

from pendulum_twin.files import write_atomically

DIGEST_BYTES = hashlib.sha256().digest_size


class DamagedFileError(Exception):
    """A file of machine code does not hold what was written."""


class CheckedFiles:
    """Hold the machine code of a function, a file for each signature; see Numba's `Cache`.

    folder: of the files.
    base: begin of their names: function, line, version of Python.
    stamp: of the function's source file; machine code of another stamp counts as not there.
    """

    def __init__(self, folder: Path, base: str, stamp: Any) -> None:
        self._folder, self._base, self._stamp = folder, base, stamp
        self._index = folder / f"{base}.numba-{numba.__version__}.nbi"

    def load(self, key: Any) -> Any:
        """Return what was saved under a key, None for nothing.

        Raises DamagedFileError, or OSError, when a file cannot be used.
        """
        name = self._read_index().get(key)
        if name is None:
            return None
        content = (self._folder / name).read_bytes()
        if name != self._name_content(content):
            raise DamagedFileError(name)
        return pickle.loads(content)

    def save(self, key: Any, data: Any) -> None:
        """Save data under a key: its file first, so that a kill leaves no entry without a file."""
        content = dumps(data)
        name = self._name_content(content)
        write_atomically(self._folder / name, content)
        try:
            names = self._read_index()
        except (DamagedFileError, OSError):
            names = {}
        self._write_index({**names, key: name})

    def flush(self) -> None:
        """Forget all that was saved."""
        self._write_index({})

    def _name_content(self, content: bytes) -> str:
        return f"{self._base}.{hashlib.sha256(content).hexdigest()}.nbc"

    def _read_index(self) -> dict[Any, str]:
        """Return the names of the files by key."""
        try:
            content = self._index.read_bytes()
        except FileNotFoundError:
            return {}
        digest, packed = content[:DIGEST_BYTES], content[DIGEST_BYTES:]
        if digest != hashlib.sha256(packed).digest():
            raise DamagedFileError(self._index.name)
        stamp, names = pickle.loads(packed)
        return names if stamp == self._stamp else {}

    def _write_index(self, names: dict[Any, str]) -> None:
        packed = dumps((self._stamp, names))
        write_atomically(self._index, hashlib.sha256(packed).digest() + packed)
