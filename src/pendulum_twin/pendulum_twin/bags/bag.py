"""A rosbag2 folder while it is written: readable from the first moment, whole when closed.

A killed process loses the messages since the last flush. A power cut also loses what the system
has not yet written to the disk, with usual settings the last half minute: only the first index and
the closed bag are synchronised.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from pendulum_twin.bags.mcap_file import McapFile, split_into_chunks
from pendulum_twin.bags.metadata import format_yaml, make_index, write_index
from pendulum_twin.bags.records import Message, Tally, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest

IN_FILE = "rosbag2"  # name of the index within the data file, where readers look for it
MEGABYTE = 1_000_000


class Bag:
    """Write a new folder.

    folder: where; it must not exist.
    compression: of the chunks, "none" or "zstd".
    started_ns: time of the first index, since the epoch.
    custom: texts for the index's `custom_data`; they may be changed until `close`.
    data_name: name of the data file; "" for the folder's with _0.mcap, as ROS names it.
    least_free_bytes: the bag refuses to write when less is free on the disk.
    Raises BadInputError when the folder exists or cannot be made, or when the disk is full.
    """

    def __init__(
        self,
        folder: Path,
        compression: str = "none",
        started_ns: int = 0,
        custom: Mapping[str, str] | None = None,
        least_free_bytes: int = 0,
        data_name: str = "",
    ) -> None:
        self.folder = Path(os.path.abspath(folder))
        self.custom = {"state": "recording", "started": _format_date(started_ns), **(custom or {})}
        self.tally = Tally()
        self._started_ns, self._least_free_bytes = started_ns, least_free_bytes
        self._topics: dict[str, Topic] = {}
        self._pending: list[Message] = []
        self._is_cut = self._is_closed = False
        self._data_path = self.folder / (data_name or f"{self.folder.name}_0.mcap")
        _make_folder(self.folder)
        try:
            self._check_space()
            self._file = McapFile(self._data_path, compression)
            self._write_index_in_file()
            self.refresh(sync=True)
        except OSError as error:
            shutil.rmtree(self.folder, ignore_errors=True)
            raise _explain_no_place(self.folder, error) from error
        except BadInputError:
            self.folder.rmdir()
            raise

    @property
    def size_bytes(self) -> int:
        """Return the size of the data file."""
        return self._file.size_bytes

    def add_topic(self, topic: Topic) -> None:
        """Declare a topic before its first message; a second call changes nothing."""
        if topic.name not in self._topics:
            self._topics[topic.name] = topic
            self._file.add_topic(topic)

    def keep(self, message: Message) -> None:
        """Take a message of a declared topic; the next `flush` writes it."""
        self._pending.append(message)

    def flush(self) -> None:
        """Hand the pending messages to the system, in the order of receiving.

        Raises BadInputError when the disk is full or fails; then only `close` may follow.
        """
        try:
            self._write_pending()
            self._check_space()
        except OSError as error:
            raise self._cut_short(error) from error

    def refresh(self, sync: bool = False) -> None:
        """Write the index of what is flushed so far; raise OSError when it cannot be written.

        sync: wait for the disk.
        """
        self.custom["seconds"] = f"{self.tally.duration_ns / 1e9:.3f}"
        self.custom["messages"] = json.dumps(self.tally.messages)
        write_index(self.folder, self._make_index(), sync)

    def close(self, state: str = "whole") -> None:
        """Write pending messages, summary, index and digest; a second call does nothing.

        After a failed write the data file stays without a summary, and the index says "cut".
        state: of the recording, for the index.
        Raises BadInputError when the disk fails now.
        """
        if self._is_closed:
            return
        self._is_closed = True
        try:
            self._end(state)
            self.refresh(sync=True)
            _sync_folder(self.folder)
        except OSError as error:
            raise self._cut_short(error) from error

    def _end(self, state: str) -> None:
        """Bring the data file to its end."""
        if self._is_cut:
            self.custom["state"] = "cut"
            self._file.abandon()
            return
        try:
            self._write_pending()
            self.custom["state"] = state
            self._write_index_in_file()
            self._file.close()
            self.custom["digest"] = compute_digest([self._data_path])
        except OSError:
            self.custom["state"] = "cut"
            with suppress(OSError):
                self._file.abandon()
                self.refresh()
            raise

    def _write_pending(self) -> None:
        pending, self._pending = self._pending, []
        pending.sort(key=lambda message: message.received_ns)
        for chunk in split_into_chunks(pending, self._file.room_bytes):
            self._file.write_chunk(chunk)
            for message in chunk:
                self.tally.add(message)

    def _check_space(self) -> None:
        free = shutil.disk_usage(self.folder).free
        if free < self._least_free_bytes:
            raise BadInputError(
                f"{self.folder}: expected at least {self._least_free_bytes / MEGABYTE:g} MB free "
                f"on the disk, found {free / MEGABYTE:.0f} MB: make room, or name another place"
            )

    def _cut_short(self, error: OSError) -> BadInputError:
        self._is_cut = True
        return BadInputError(
            f"{self.folder}: the recording ends after {self.tally.total} messages "
            f"({error.strerror}); they are readable, and `recorder_node --recover {self.folder}` "
            "makes a whole bag of them"
        )

    def _make_index(self) -> dict[str, Any]:
        return make_index(
            self._data_path.name, self._topics.values(), self.tally, self._started_ns, self.custom
        )

    def _write_index_in_file(self) -> None:
        self._file.write_metadata(
            IN_FILE, {"serialized_metadata": format_yaml(self._make_index())}
        )


def _make_folder(folder: Path) -> None:
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise BadInputError(
            f"{folder}: expected no folder there, found one: "
            "recordings are not overwritten, name another"
        ) from None
    except OSError as error:
        raise _explain_no_place(folder, error) from error


def _explain_no_place(folder: Path, error: OSError) -> BadInputError:
    return BadInputError(
        f"{folder}: expected a place to write to, found {error.strerror}: name another"
    )


def _sync_folder(folder: Path) -> None:
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _format_date(time_ns: int) -> str:
    return datetime.fromtimestamp(time_ns / 1e9, UTC).isoformat(timespec="milliseconds")
