"""The files of a bag: their list, the index beside them, and the digest over their bytes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

from pendulum_sysid.errors import FileError
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_yaml
from pendulum_twin.topics import PLAYED

DATA_SUFFIXES = (".mcap", ".db3")
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".mat", ".npz", ".parquet")  # for `import`
ROS1_SUFFIX = ".bag"  # likewise
INDEX = "metadata.yaml"
OUTCOME_KEY = "plan_outcome"  # in the index's custom data, from recorder_node
INDEX_MOST_BYTES = 10_000_000  # a topic of ROS 2 Jazzy has about 3,000: room for 3,000 topics
MOST_MESSAGES = 2**48  # a larger count is no count


@dataclass(frozen=True)
class BagFiles:
    """Name a bag's data files in the order of recording.

    counted: topic -> number of messages by the index, empty when there is none. packed_messages:
    True when each message is compressed by itself. custom: the index's `custom_data`.
    """

    files: tuple[Path, ...]
    counted: dict[str, int] = field(default_factory=dict)
    packed_messages: bool = False
    custom: Mapping[str, Any] = field(default_factory=dict)


def find_files(path: Path) -> BagFiles:
    """Return the data files of a rosbag2 folder, or of a single data file.

    A folder whose index is missing or unreadable (the recorder was killed) is taken by its data
    files. A file that the index names and the folder lacks is left out: the messages it held are
    counted as lost.
    Raises FileError when nothing is there or nothing that is a bag.
    """
    if not path.exists():
        raise FileError(
            "expected a recording (a rosbag2 folder or its data file), found nothing there: check "
            "the path"
        )
    if path.is_file():
        if path.suffix.lower() in (*TABLE_SUFFIXES, ROS1_SUFFIX):
            raise FileError(
                f"expected a recording (a rosbag2 folder or its data file), found {path.name}: "
                "turn it into a recording with sysid import"
            )
        if not is_data_file(path):
            raise FileError(
                f"expected a rosbag2 folder, an .mcap or a .db3 file, found a file {path.name}: "
                "name the bag"
            )
        return _check_not_empty(BagFiles((path,)))
    index = _read_index(path)
    names = _list_entries(index, "relative_file_paths", str)
    named = dict.fromkeys(path / PurePath(name).name for name in names)
    files = [p for p in named if p.is_file()] or sorted(
        p for p in path.iterdir() if is_data_file(p)
    )
    if not files:
        contents = (
            f"{INDEX} without its data files" if index else "a folder without .mcap or .db3 files"
        )
        raise FileError(
            f"expected a rosbag2 folder, found {contents}: name the folder that the recorder wrote"
        )
    return _check_not_empty(
        BagFiles(
            tuple(files),
            _read_counts(index),
            str(index.get("compression_mode")).lower() == "message",
            _read_custom(index),
        )
    )


def is_data_file(path: Path) -> bool:
    """Tell whether the name is that of a data file, packed by zstd or not."""
    name = path.name.removesuffix(".zstd")
    return path.is_file() and not name.startswith(".") and name.endswith(DATA_SUFFIXES)


def _check_not_empty(bag: BagFiles) -> BagFiles:
    if all(p.stat().st_size == 0 for p in bag.files):
        raise FileError(
            f"expected a recording, found {bag.files[0].name} empty (0 bytes): record again"
        )
    return bag


def _read_index(folder: Path) -> dict[str, Any]:
    """Return what the index says; nothing when it is missing, too large, or no index."""
    try:
        whole = read_yaml(folder / INDEX, "the index of a bag", INDEX_MOST_BYTES)
    except BadInputError:
        return {}
    index = whole.get("rosbag2_bagfile_information") if isinstance(whole, dict) else None
    return index if isinstance(index, dict) else {}


def _read_custom(index: dict[str, Any]) -> dict[str, Any]:
    custom = index.get("custom_data")
    return custom if isinstance(custom, dict) else {}


def find_plan_outcome(bag: BagFiles) -> str:
    """Return how the plan of a bag ended, as its recorder noted; PLAYED when nothing was noted."""
    return str(bag.custom.get(OUTCOME_KEY, PLAYED))


def _list_entries(index: dict[str, Any], key: str, kind: type) -> list[Any]:
    """Return the entries of a list that are of a kind; none when it is no list."""
    entries = index.get(key)
    return [e for e in entries if isinstance(e, kind)] if isinstance(entries, list) else []


def _read_counts(index: dict[str, Any]) -> dict[str, int]:
    """Return topic -> number of messages, from those entries that say both."""
    counted: dict[str, int] = {}
    for entry in _list_entries(index, "topics_with_message_count", dict):
        described, count = entry.get("topic_metadata"), entry.get("message_count")
        topic = described.get("name") if isinstance(described, dict) else None
        if isinstance(topic, str) and type(count) is int and 0 <= count < MOST_MESSAGES:
            counted[topic] = counted.get(topic, 0) + count
    return counted
