"""Read what the recorder wrote with readers that share nothing with it."""

from pathlib import Path
from typing import Any, NamedTuple

import yaml
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader


class Read(NamedTuple):
    topic: str
    received_ns: int
    data: bytes
    decoded: Any


def data_file(folder: Path) -> Path:
    return folder / f"{folder.name}_0.mcap"


def with_rosbags(folder: Path) -> list[Read]:
    with AnyReader([folder]) as reader:
        return [
            Read(c.topic, time_ns, bytes(data), reader.deserialize(data, c.msgtype))
            for c, time_ns, data in reader.messages()
        ]


def with_mcap(folder: Path) -> list[Read]:
    with data_file(folder).open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = reader.iter_decoded_messages()
        return [Read(c.topic, m.log_time, m.data, decoded) for _, c, m, decoded in found]


def index(folder: Path) -> dict[str, Any]:
    return yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


def counts(folder: Path) -> dict[str, int]:
    return {
        each["topic_metadata"]["name"]: each["message_count"]
        for each in index(folder)["topics_with_message_count"]
    }
