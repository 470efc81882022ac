"""A rosbag2 data file that is readable up to its last chunk at any moment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import IO, cast

import yaml
from mcap.writer import CompressionType, Writer

from pendulum_twin.bags.growing_file import GrowingFile
from pendulum_twin.bags.records import Message, Topic

LARGEST_CHUNK = 64 * 1024  # bytes before compression
NEVER = 1 << 62  # bytes after which the writer ends a chunk by itself
MESSAGE_HEAD = 31  # bytes of a message's record before its data
COMPRESSIONS = {"none": CompressionType.NONE, "zstd": CompressionType.ZSTD}
SEQUENCE_MASK = 0xFFFFFFFF  # the format keeps 32 bits


class McapFile:
    """Write topics and messages; the kernel has a chunk when `write_chunk` returns.

    After an OSError the file ends with the last whole chunk, and only `abandon` may follow.
    """

    def __init__(self, path: Path, compression: str = "none") -> None:
        self._file = GrowingFile(path)
        stream = cast(IO[bytes], self._file)  # the writer needs write, tell and flush
        self._writer = Writer(stream, chunk_size=NEVER, compression=COMPRESSIONS[compression])
        self._writer.start(profile="ros2", library="pendulum_bridge")
        self._writer.flush()
        self._schemas: dict[str, int] = {}
        self._channels: dict[str, int] = {}
        self._definition_bytes = 0  # in the next chunk

    @property
    def size_bytes(self) -> int:
        """Return the number of bytes written."""
        return self._file.tell()

    @property
    def room_bytes(self) -> int:
        """Return the number of bytes that the next chunk may still hold."""
        return LARGEST_CHUNK - self._definition_bytes

    def add_topic(self, topic: Topic) -> None:
        """Declare a topic; it is written with the next chunk."""
        if topic.type not in self._schemas:
            encoding = "ros2msg" if topic.definition else ""
            self._schemas[topic.type] = self._writer.register_schema(
                topic.type, encoding, topic.definition.encode()
            )
            self._definition_bytes += 64 + len(topic.definition.encode())
        metadata = {
            "offered_qos_profiles": _format_qos(topic),
            "topic_type_hash": topic.type_hash,
        }
        self._channels[topic.name] = self._writer.register_channel(
            topic.name, "cdr", self._schemas[topic.type], metadata
        )
        self._definition_bytes += 128 + len(topic.name) + sum(map(len, metadata.values()))

    def write_chunk(self, messages: Iterable[Message]) -> None:
        """Write messages of declared topics as a chunk."""
        for message in messages:
            self._writer.add_message(
                self._channels[message.topic],
                log_time=message.received_ns,
                data=message.data,
                publish_time=message.published_ns,
                sequence=message.sequence & SEQUENCE_MASK,
            )
        self._writer.flush()
        self._definition_bytes = 0

    def write_metadata(self, name: str, entries: Mapping[str, str]) -> None:
        """Write a metadata record: a name and its texts."""
        self._writer.add_metadata(name, dict(entries))
        self._file.flush()

    def close(self) -> None:
        """Write the summary, wait for the disk and close the file."""
        self._writer.finish()
        self._file.sync()
        self._file.close()

    def abandon(self) -> None:
        """Close the file as it is, without a summary."""
        self._file.close()


def split_into_chunks(messages: Iterable[Message], first_room: int) -> Iterator[list[Message]]:
    """Yield the messages in groups that fit a chunk; a message that fits none stands alone.

    first_room: bytes that the first chunk may hold.
    """
    chunk: list[Message] = []
    room = first_room
    for message in messages:
        size = MESSAGE_HEAD + len(message.data)
        if chunk and size > room:
            yield chunk
            chunk, room = [], LARGEST_CHUNK
        chunk.append(message)
        room -= size
    if chunk:
        yield chunk


def _format_qos(topic: Topic) -> str:
    offered = [dict(profile) for profile in topic.offered_qos]
    return yaml.safe_dump(offered, sort_keys=False).strip() if offered else ""
