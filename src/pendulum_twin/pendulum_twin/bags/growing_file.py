"""A file that grows by whole pieces: the data of a flush is there in full, or not at all."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path


class GrowingFile:
    """Write a new file; after `flush` the kernel has the bytes, even when this process is killed.

    The writes between two flushes belong together, such as a chunk of messages and its index.
    Raises OSError when the file exists or cannot be made.
    """

    def __init__(self, path: Path) -> None:
        self._descriptor = os.open(
            path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o644
        )
        self._size = 0
        self._pending = bytearray()

    def write(self, data: bytes) -> int:
        """Take data for the next `flush`."""
        self._pending += data
        return len(data)

    def flush(self) -> None:
        """Append the pending data; raise OSError, and leave the file as it was, without space."""
        pending, self._pending = self._pending, bytearray()
        unwritten = memoryview(pending)
        try:
            while unwritten:
                unwritten = unwritten[os.write(self._descriptor, unwritten) :]
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._descriptor, self._size)
                os.lseek(self._descriptor, self._size, os.SEEK_SET)
            raise
        self._size += len(pending)

    def tell(self) -> int:
        """Return the size in bytes, pending data included."""
        return self._size + len(self._pending)

    def sync(self) -> None:
        """Flush, and wait until the disk has everything."""
        self.flush()
        os.fsync(self._descriptor)

    def close(self) -> None:
        """Close the file without pending data; a second call does nothing."""
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)
