"""Read an mcap file from front to back, as far as it goes, and keep every complete message."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from mmap import ACCESS_READ, mmap
from pathlib import Path
from typing import Any

import lz4.frame  # type: ignore[import-untyped]
import zstandard
from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode

from pendulum_twin.bags.bag import IN_FILE
from pendulum_twin.bags.metadata import parse_index
from pendulum_twin.bags.records import Message, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.strict_yaml import parse_yaml

MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")  # before each record: its kind and its size
UNREADABLE = (
    struct.error, EndOfFile, UnicodeDecodeError, OverflowError, MemoryError, RuntimeError,
    zstandard.ZstdError,
)  # fmt: skip


class Salvage:
    """Iterate once over the topics and messages of a file; a topic comes before its messages.

    The attributes are known when the iteration is over.
    is_whole: whether the file has its end mark and all messages that it counts.
    lost_bytes: bytes that could not be read.
    nameless: messages whose topic could not be read.
    saved_of_cut: messages read from a last chunk that was cut.
    custom: the `custom_data` within the file.
    Raises BadInputError when the file is no mcap file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.is_whole = False
        self.lost_bytes = self.saved_of_cut = self.nameless = 0
        self.custom: dict[str, str] = {}
        self._read_count, self._stated_count = 0, -1
        self._schemas: dict[int, records.Schema] = {}
        self._topics: dict[int, str] = {}

    def __iter__(self) -> Iterator[Topic | Message]:
        with self.path.open("rb") as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise BadInputError(
                    f"{self.path}: expected an mcap file, found one without its opening mark"
                )
            with mmap(stream.fileno(), 0, access=ACCESS_READ) as data:
                yield from self._read_file(data)

    def _read_file(self, data: mmap) -> Iterator[Topic | Message]:
        end, ended = len(MAGIC), False
        for kind, body, size in _split_records(data, end):
            complete = len(body) == size
            if kind == Opcode.CHUNK:
                yield from self._read_chunk(body, complete)
            elif complete:
                yield from self._read_record(kind, body)
            end += HEAD.size + size
            ended = kind == Opcode.FOOTER and data[end:] == MAGIC
        self.lost_bytes += 0 if ended else max(0, len(data) - min(end, len(data)))
        self.is_whole = (
            ended and not self.lost_bytes and self._stated_count in (-1, self._read_count)
        )

    def _read_chunk(self, body: bytes, complete: bool) -> Iterator[Topic | Message]:
        try:
            # of a chunk that was cut, this reads what is there
            chunk = records.Chunk.read(ReadDataStream(BytesIO(body)))
            content = _decompress(chunk)
        except UNREADABLE:
            self.lost_bytes += len(body)
            return
        if complete and (
            len(content) != chunk.uncompressed_size or _is_damaged(content, chunk.uncompressed_crc)
        ):
            self.lost_bytes += len(body)
            return
        kept = 0
        for kind, inner, size in _split_records(content, 0):
            if len(inner) == size:
                kept += HEAD.size + size
                for record in self._read_record(kind, inner):
                    self.saved_of_cut += not complete and isinstance(record, Message)
                    yield record
        self.lost_bytes += 0 if complete else max(1, len(content) - kept)

    def _read_record(self, kind: int, body: bytes) -> Iterator[Topic | Message]:
        stream = ReadDataStream(BytesIO(body))
        try:
            if kind == Opcode.MESSAGE:
                yield from self._read_message(records.Message.read(stream, len(body)))
            elif kind == Opcode.SCHEMA:
                schema = records.Schema.read(stream)
                self._schemas[schema.id] = schema
            elif kind == Opcode.CHANNEL:
                yield self._read_topic(records.Channel.read(stream))
            elif kind == Opcode.STATISTICS:
                self._stated_count = records.Statistics.read(stream).message_count
            elif kind == Opcode.METADATA:
                note = records.Metadata.read(stream)
                if note.name == IN_FILE:
                    custom = parse_index(note.metadata.get("serialized_metadata", "")).get(
                        "custom_data"
                    )
                    self.custom = {str(key): str(text) for key, text in (custom or {}).items()}
        except UNREADABLE:
            self.lost_bytes += len(body)

    def _read_message(self, message: records.Message) -> Iterator[Message]:
        name = self._topics.get(message.channel_id)
        if name is None:
            self.nameless += 1
        else:
            self._read_count += 1
            yield Message(
                name, message.log_time, message.publish_time, message.sequence, message.data
            )

    def _read_topic(self, channel: records.Channel) -> Topic:
        self._topics[channel.id] = channel.topic
        schema = self._schemas.get(channel.schema_id)
        offered = _read_profiles(channel.metadata.get("offered_qos_profiles", ""))
        return Topic(
            name=channel.topic,
            type=schema.name if schema else "unknown",
            definition=schema.data.decode() if schema else "",
            type_hash=channel.metadata.get("topic_type_hash", ""),
            offered_qos=offered,
        )


def _read_profiles(text: str) -> tuple[dict[str, Any], ...]:
    """Return the quality of service that publishers offered; none when it cannot be read."""
    try:
        profiles = parse_yaml(text)
    except BadInputError:
        return ()
    return tuple(profiles) if isinstance(profiles, list) else ()


def _split_records(data: bytes | mmap, position: int) -> Iterator[tuple[int, bytes, int]]:
    """Yield kind, content as far as it is there, and stated size of each record.

    Stops at bytes that are no record, such as zeros after a crash.
    """
    while position + HEAD.size <= len(data):
        kind, size = HEAD.unpack_from(data, position)
        if kind == 0:
            return
        position += HEAD.size
        yield kind, bytes(data[position : position + size]), size
        position += size


def _decompress(chunk: records.Chunk) -> bytes:
    if chunk.compression == "zstd":
        return zstandard.ZstdDecompressor().decompressobj().decompress(chunk.data)
    if chunk.compression == "lz4":
        return bytes(lz4.frame.LZ4FrameDecompressor().decompress(chunk.data))
    if chunk.compression:
        raise RuntimeError(f"unknown compression {chunk.compression}")
    return chunk.data


def _is_damaged(content: bytes, checksum: int) -> bool:
    return checksum not in (0, zlib.crc32(content))
