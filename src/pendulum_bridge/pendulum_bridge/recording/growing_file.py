"""A file that only grows, by whole stretches: what was given is there in full, or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


class GrowingFile:
    """Write a new file; after `flush` the kernel has the bytes, whatever becomes of this process.

    What is written between two flushes belongs together: a chunk of messages and the index after
    it are two writes. Raises OSError when the file exists or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(
            path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644
        )
        self._size = 0
        self._given = bytearray()

    def write(self, data: bytes) -> int:
        """Take data for the next `flush`."""
        self._given += data
        return len(data)

    def flush(self) -> None:
        """Append what was given; when that fails (no space), take back what went in, forget it and raise OSError."""
        given, self._given = self._given, bytearray()
        rest = memoryview(given)
        try:
            while rest:
                rest = rest[os.write(self._descriptor, rest) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self._size)
                os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise
        self._size += len(given)

    def tell(self) -> int:
        """Return the size with what was given, bytes."""
        return self._size + len(self._given)

    def sync(self) -> None:
        """Flush, and wait until the disk has everything."""
        self.flush()
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Close the file without what was not flushed; a second time does nothing."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)
