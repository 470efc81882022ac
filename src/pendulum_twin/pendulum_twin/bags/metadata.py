"""The index of a rosbag2 folder, `metadata.yaml`, version 9."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from pendulum_twin.bags.records import Tally, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.strict_yaml import parse_yaml

INDEX = "metadata.yaml"
ROOT = "rosbag2_bagfile_information"
VERSION = 9
ROS_DISTRO = "jazzy"


def make_index(
    data_file: str,
    topics: Iterable[Topic],
    tally: Tally,
    started_ns: int,
    custom: Mapping[str, str],
) -> dict[str, Any]:
    """Return the index of a data file.

    started_ns: time of the start since the epoch; it stands for the first message's time as long
        as there is no message.
    custom: texts of `custom_data`.
    """
    span = {
        "duration": {"nanoseconds": tally.duration_ns},
        "starting_time": {
            "nanoseconds_since_epoch": started_ns if tally.first_ns is None else tally.first_ns
        },
        "message_count": tally.total,
    }
    return {
        "version": VERSION,
        "storage_identifier": "mcap",
        **span,
        "topics_with_message_count": [
            _make_entry(topic, tally.messages.get(topic.name, 0)) for topic in topics
        ],
        "compression_format": "",  # of the whole file; the data file names that of its chunks
        "compression_mode": "",
        "relative_file_paths": [data_file],
        "files": [{"path": data_file, **span}],
        "custom_data": dict(custom),
        "ros_distro": ROS_DISTRO,
    }


def _make_entry(topic: Topic, count: int) -> dict[str, Any]:
    metadata = {
        "name": topic.name,
        "type": topic.type,
        "serialization_format": "cdr",
        "offered_qos_profiles": [dict(profile) for profile in topic.offered_qos],
        "type_description_hash": topic.type_hash,
    }
    return {"topic_metadata": metadata, "message_count": count}


def format_yaml(index: Mapping[str, Any]) -> str:
    """Return an index as YAML; texts of several lines stay readable."""
    return yaml.dump(dict(index), Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=1000)


class _Dumper(yaml.SafeDumper):
    """Write texts of several lines as they are, and no references."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _represent_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar(
        "tag:yaml.org,2002:str", text, style="|" if "\n" in text else None
    )


_Dumper.add_representer(str, _represent_text)


def write_index(folder: Path, index: Mapping[str, Any], sync: bool = False) -> None:
    """Replace the folder's index at once: a reader sees the old index or the new index.

    sync: wait for the disk.
    Raises OSError; then the old index stays.
    """
    temporary = folder / f".{INDEX}.new"
    try:
        with temporary.open("w", encoding="utf-8") as stream:
            stream.write(format_yaml({ROOT: index}))
            if sync:
                stream.flush()
                os.fsync(stream.fileno())
        temporary.replace(folder / INDEX)
    except OSError:
        temporary.unlink(missing_ok=True)
        raise


def read_index(folder: Path) -> dict[str, Any]:
    """Return a folder's index; an empty one when it cannot be read."""
    try:
        return parse_index((folder / INDEX).read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError):
        return {}


def parse_index(text: str) -> dict[str, Any]:
    """Return the index that a text holds, with or without its root; empty when there is none."""
    try:
        content = parse_yaml(text)
    except BadInputError:
        return {}
    index = content.get(ROOT, content) if isinstance(content, dict) else {}
    return index if isinstance(index, dict) else {}
