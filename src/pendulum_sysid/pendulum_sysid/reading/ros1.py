"""Turn a bag of ROS 1 into a rosbag2 folder; rosbags knows both formats."""

from __future__ import annotations

import tempfile
from pathlib import Path

from pendulum_sysid.errors import FileError
from pendulum_sysid.reading.bag_files import ROS1_SUFFIX

MCAP_VERSION = 9  # of the index, as ROS 2 Jazzy writes it


def is_ros1_bag(path: Path) -> bool:
    """Tell whether the name is that of a bag of ROS 1."""
    return path.suffix.lower() == ROS1_SUFFIX


def import_ros1_bag(bag: Path, out: Path) -> dict[str, tuple[str, int]]:
    """Write the messages of a bag of ROS 1 as a rosbag2 folder, whole or not at all.

    Returns topic -> type and number of messages. Raises FileError when the bag cannot be read, or
    the folder is there already or cannot be written.
    """
    from rosbags.convert.converter import convert  # only for such files
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    if out.exists():
        raise FileError(
            f"{out}: expected a new folder to write, found it there already: name another or "
            "remove it"
        )
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        beside = tempfile.TemporaryDirectory(dir=out.parent, prefix=f".{out.name}.")
    except OSError as error:
        raise FileError(
            f"{out}: expected a place to write to, found {error.strerror}: name another"
        ) from error
    try:
        with beside as folder:
            whole = Path(folder) / out.name
            jazzy = get_typestore(Stores.ROS2_JAZZY)
            convert(
                [bag], whole, "mcap", MCAP_VERSION, None, "none", None, jazzy, (), (), (), ()
            )  # fmt: skip
            with AnyReader([whole]) as reader:
                topics = {name: (info.msgtype or "", info.msgcount)
                          for name, info in reader.topics.items()}  # fmt: skip
            whole.rename(out)
    except Exception as error:  # of three packages, with their own errors
        raise FileError(
            f"{bag}: expected a bag of ROS 1, but it cannot be converted ({error}): check it with "
            "rosbag info"
        ) from error
    return topics
