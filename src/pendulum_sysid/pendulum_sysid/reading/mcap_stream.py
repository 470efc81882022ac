"""Read an mcap file from front to back, as far as it goes.

A recorder that was killed leaves a file without summary and footer, often in the middle of a
chunk. Readers that begin at the footer refuse such a file, and the stream reader of the `mcap`
package drops the chunk that was cut; this one keeps every message that is there in full. Format:
https://mcap.dev/spec
"""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path

import zstandard

from pendulum_sysid.errors import FileError
from pendulum_sysid.reading.contents import Contents
from pendulum_sysid.reading.sending_times import find_sending_times
from pendulum_sysid.reading.unpacking import MOST_CHUNK_BYTES, unpack_lz4, unpack_zstd

MAGIC = b"\x89MCAP0\r\n"
FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, STATISTICS = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0B

LATEST_NS = 2**63 - 1  # the year 2262: what a 64-bit clock counts to
CHUNK_CRC_AT = 24  # bytes: begin, end and size of a chunk's messages stand before it
CHUNK_HEAD_BYTES = 40  # with the empty name of no compression and the length of the records

Buffer = bytes | mmap.mmap


def scan_mcap(path: Path, wanted: Collection[str]) -> Contents:
    """Return the messages of the wanted topics up to where the file ends or can no longer be read.

    Raises FileError when it is no mcap file.
    """
    with path.open("rb") as stream:
        if stream.read(len(MAGIC)) != MAGIC:
            raise FileError(
                f"expected an mcap file, found {path.name} without its opening mark: record again"
            )
        with mmap.mmap(stream.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return _Scan(wanted).run(data)


def write_checksums(path: Path) -> None:
    """Write the CRC of each chunk that has none and is not compressed, so that damage shows."""
    with path.open("r+b") as stream, mmap.mmap(stream.fileno(), 0) as data:
        position = len(MAGIC)
        while position + 9 <= len(data) - len(MAGIC):
            opcode, size = struct.unpack_from("<BQ", data, position)
            content = position + 9 + CHUNK_HEAD_BYTES
            if opcode == CHUNK and data[content - 12 : content - 8] == bytes(4):
                crc = zlib.crc32(data[content : position + 9 + size])
                struct.pack_into("<I", data, position + 9 + CHUNK_CRC_AT, crc)
            position += 9 + size


class _Scan:
    """Walk the records of one file and keep what they say."""

    def __init__(self, wanted: Collection[str]) -> None:
        self.contents = Contents(wanted, whole=False)
        self.schemas: dict[int, str] = {}
        self.topics: dict[int, str] = {}
        self.nameless: list[
            tuple[int, bytes]
        ] = []  # their channel was in a damaged chunk; the summary may name it
        self.published: dict[str, list[int]] = {}  # topic -> ns, of the messages in `contents`

    def run(self, data: Buffer) -> Contents:
        for opcode, body, complete in _list_records(data, len(MAGIC)):
            if opcode == FOOTER:
                self.contents.whole = complete and not self.contents.damaged_parts
                break
            if opcode == CHUNK:
                self.chunk(body, complete)
            elif complete:
                self.record(opcode, body)
        later, self.nameless = self.nameless, []
        for opcode, body in later:
            self.record(opcode, body)
        self.contents.whole &= not self.nameless
        for topic, messages in self.contents.messages.items():
            times = find_sending_times([time for time, _ in messages], self.published[topic])
            messages[:] = zip(times, (data for _, data in messages), strict=True)
        return self.contents

    def chunk(self, body: bytes, complete: bool) -> None:
        try:
            content, intact = _unpacked(body, complete)
        except (struct.error, zstandard.ZstdError, RuntimeError, UnicodeDecodeError):
            content, intact = b"", False
        self.contents.damaged_parts += not intact
        for opcode, inner, inner_complete in _list_records(content, 0):
            if inner_complete:
                self.record(opcode, inner)

    def record(self, opcode: int, body: bytes) -> None:
        try:
            if opcode == MESSAGE:
                channel, _, time_ns, published_ns = struct.unpack_from("<HIQQ", body)
                if time_ns > LATEST_NS:
                    self.contents.damaged_parts += 1
                elif channel in self.topics:
                    topic = self.topics[channel]
                    if self.contents.add(topic, time_ns, body[22:]):
                        self.published.setdefault(topic, []).append(published_ns)
                else:
                    self.nameless.append((opcode, body))
            elif opcode == SCHEMA:
                self.schemas[struct.unpack_from("<H", body)[0]] = _read_string(body, 2)
            elif opcode == CHANNEL:
                channel, schema = struct.unpack_from("<HH", body)
                self.topics[channel] = _read_string(body, 4)
                self.contents.types[self.topics[channel]] = self.schemas.get(schema, "unknown")
            elif opcode == STATISTICS:
                self.statistics(body)
        except (struct.error, KeyError, UnicodeDecodeError):
            self.contents.damaged_parts += 1

    def statistics(self, body: bytes) -> None:
        (size,) = struct.unpack_from("<I", body, 42)
        for channel, count in struct.iter_unpack("<HQ", body[46 : 46 + size]):
            topic = self.topics[channel]
            self.contents.counted[topic] = self.contents.counted.get(topic, 0) + count


def _list_records(data: Buffer, position: int) -> Iterator[tuple[int, bytes, bool]]:
    """Yield opcode, content, and whether the content is all there, up to the first damage."""
    while position + 9 <= len(data):
        opcode, size = struct.unpack_from("<BQ", data, position)
        position += 9
        if opcode == 0:  # no record has it: a crash left zeros behind
            return
        body = bytes(data[position : position + size])
        yield opcode, body, len(body) == size
        position += size


def _read_string(body: bytes, position: int) -> str:
    (size,) = struct.unpack_from("<I", body, position)
    return body[position + 4 : position + 4 + size].decode()


def _unpacked(body: bytes, complete: bool) -> tuple[bytes, bool]:
    """Return a chunk's records as far as they are there, and whether all are, unharmed.

    A chunk unpacks to at most the size that it declares, and to at most `MOST_CHUNK_BYTES`.
    """
    _, _, size, checksum = struct.unpack_from("<QQQI", body)
    compression = _read_string(body, 28)
    content = body[40 + len(compression) :]
    most = min(size, MOST_CHUNK_BYTES)
    if compression == "zstd":
        content = unpack_zstd(content, most)
    elif compression == "lz4":
        content = unpack_lz4(content, most)
    elif compression:
        return b"", False
    intact = complete and len(content) == size and checksum in (0, zlib.crc32(content))
    return (content if intact or not complete else b""), intact
