"""Unpack compressed parts of a recording, within bounds: a few kilobytes can expand to gigabytes.

A part may become as large as its file says, and at most as large as a limit. What does not fit
is not unpacked any further.
"""

from __future__ import annotations

from pathlib import Path

import lz4.frame  # type: ignore[import-untyped]
import zstandard

from pendulum_sysid.errors import FileError

MOST_CHUNK_BYTES = 1 << 28  # of a chunk: recorders write chunks of 64 KiB to 4 MiB
MOST_MESSAGE_BYTES = 1 << 20  # of a message: a JointState of two joints has 150 bytes
LEAST_FILE_BYTES = 1 << 26  # of an unpacked file: smaller ones are never refused
MOST_FILE_RATIO = 200  # unpacked to packed: joint states are packed to a tenth at best
BLOCK_BYTES = 1 << 20


def unpack_zstd(data: bytes, most: int) -> bytes:
    """Return what data hold, as far as they go, and at most so many bytes and one more.

    Raises zstandard.ZstdError for damaged data.
    """
    with zstandard.ZstdDecompressor().stream_reader(data) as stream:
        return stream.read(most + 1)


def unpack_lz4(data: bytes, most: int) -> bytes:
    """Return what data hold, as far as they go, and at most so many bytes and one more.

    Raises RuntimeError for damaged data.
    """
    return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most + 1)


def unpack_message(data: bytes) -> bytes:
    """Return a message that is packed by itself; empty, which does not decode, if it cannot be."""
    try:
        content = unpack_zstd(data, MOST_MESSAGE_BYTES)
    except zstandard.ZstdError:
        return b""
    return content if len(content) <= MOST_MESSAGE_BYTES else b""


def unpack_file(path: Path, folder: Path) -> Path:
    """Return the file itself, or its copy in the folder when it is packed as a whole (`.zstd`).

    Raises FileError for a damaged file and for a file that expands beyond all recordings.
    """
    if path.suffix != ".zstd":
        return path
    target = folder / path.stem
    room = max(LEAST_FILE_BYTES, MOST_FILE_RATIO * path.stat().st_size)
    try:
        with path.open("rb") as packed, target.open("wb") as stream:
            for block in zstandard.ZstdDecompressor().read_to_iter(packed, write_size=BLOCK_BYTES):
                room -= len(block)
                if room < 0:
                    raise FileError(
                        f"expected a packed recording, found that {path.name} expands to more "
                        f"than {MOST_FILE_RATIO} times its size: unpack it by hand if it is one"
                    )
                stream.write(block)
    except zstandard.ZstdError as error:
        raise FileError(
            f"expected a file packed by zstd, found {path.name} damaged ({error}): unpack it by "
            "hand"
        ) from error
    return target
