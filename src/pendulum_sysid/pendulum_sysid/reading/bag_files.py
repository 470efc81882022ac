"""The files of a bag: their list, the index beside them, and the digest over their bytes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

import zstandard

from pendulum_sysid.errors import FileError
from pendulum_twin.errors import BadInputError
from pendulum_twin.strict_yaml import parse_yaml

DATA_SUFFIXES = (".mcap", ".db3")
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".mat", ".npz", ".parquet")  # for `import`
INDEX = "metadata.yaml"


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
    files. A file that the
    index names and the folder lacks is left out: the messages it held are counted as lost.
    Raises FileError when nothing is there or nothing that is a bag.
    """
    if not path.exists():
        raise FileError(
            "expected a recording (a rosbag2 folder or its data file), found nothing there: check "
            "the path"
        )
    if path.is_file():
        if path.suffix.lower() in TABLE_SUFFIXES:
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
    named = [path / PurePath(str(name)).name for name in index.get("relative_file_paths") or []]
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


def unpack(path: Path, folder: Path) -> Path:
    """Return the file itself, or its copy in the folder when it is packed as a whole (`.zstd`)."""
    if path.suffix != ".zstd":
        return path
    target = folder / path.stem
    try:
        with path.open("rb") as packed, target.open("wb") as stream:
            zstandard.ZstdDecompressor().copy_stream(packed, stream)
    except zstandard.ZstdError as error:
        raise FileError(
            f"expected a file packed by zstd, found {path.name} damaged ({error}): unpack it by "
            "hand"
        ) from error
    return target


def _check_not_empty(bag: BagFiles) -> BagFiles:
    if all(p.stat().st_size == 0 for p in bag.files):
        raise FileError(
            f"expected a recording, found {bag.files[0].name} empty (0 bytes): record again"
        )
    return bag


def _read_index(folder: Path) -> dict:
    try:
        whole = parse_yaml((folder / INDEX).read_text(encoding="utf-8"))
        index = whole["rosbag2_bagfile_information"]
        return index if isinstance(index, dict) else {}
    except (OSError, UnicodeDecodeError, BadInputError, KeyError, TypeError):
        return {}


def _read_custom(index: dict) -> dict[str, Any]:
    custom = index.get("custom_data")
    return custom if isinstance(custom, dict) else {}


def _read_counts(index: dict) -> dict[str, int]:
    counted: dict[str, int] = {}
    for entry in index.get("topics_with_message_count") or []:
        try:
            topic = str(entry["topic_metadata"]["name"])
            counted[topic] = counted.get(topic, 0) + int(entry["message_count"])
        except (KeyError, TypeError, ValueError):
            continue
    return counted
