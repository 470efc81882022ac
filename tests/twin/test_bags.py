"""Bags that both packages write: every chunk has a CRC, samples and commands stand in time."""

import struct
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.stream_reader import StreamReader

from pendulum_bridge.recording.bag_writer import Log
from pendulum_bridge.recording.bag_writer import write_bag as write_of_bridge
from pendulum_sysid.reading.bag import write_bag as write_of_sysid
from pendulum_twin.bags.metadata import read_index

COUNT = 3000
STAMPS = 1_700_000_000_000_000_000 + 10_000_000 * np.arange(COUNT)
CART = np.linspace(-0.5, 0.5, COUNT)


def write_with_bridge(path: Path) -> None:
    columns = CART[:, None]
    write_of_bridge(Log(STAMPS, ("cart",), columns, 0 * columns, CART), path)


def write_with_sysid(path: Path) -> None:
    late = STAMPS + 5_000_000
    write_of_sysid(path, STAMPS, {"cart": CART}, CART, command_times_ns=late)


WRITERS = {"bridge": write_with_bridge, "sysid": write_with_sysid}


@pytest.fixture(params=WRITERS)
def written(request, tmp_path: Path) -> Path:
    WRITERS[request.param](tmp_path / "bag")
    return tmp_path / "bag" / "bag.mcap"


def list_chunks(path: Path) -> list[Chunk]:
    with path.open("rb") as stream:
        records = StreamReader(stream, emit_chunks=True).records
        return [record for record in records if isinstance(record, Chunk)]


def test_every_chunk_has_a_crc(written: Path) -> None:
    chunks = list_chunks(written)
    assert len(chunks) > 3 and all(chunk.uncompressed_crc for chunk in chunks)


def test_a_flipped_bit_of_a_number_is_found(written: Path) -> None:
    content = bytearray(written.read_bytes())
    at = content.index(struct.pack("<d", CART[COUNT // 2]))
    content[at + 6] ^= 1
    written.write_bytes(content)
    with written.open("rb") as stream, pytest.raises(Exception, match=r"(?i)crc"):
        list(StreamReader(stream, validate_crcs=True).records)


def test_samples_and_commands_stand_in_the_order_of_their_times(written: Path) -> None:
    with written.open("rb") as stream:
        seen = [
            (message.log_time, channel.topic)
            for _, channel, message in make_reader(stream).iter_messages(log_time_order=False)
        ]
    assert seen == sorted(seen, key=lambda pair: pair[0]) and len(seen) == 2 * COUNT
    assert [topic for _, topic in seen[:4]] == ["/rig/joint_states", "/rig/pwm"] * 2
    # half of the file holds half of either topic
    first = [topic for _, topic in seen[:COUNT]]
    assert first.count("/rig/pwm") == COUNT // 2


def test_the_same_arrays_give_the_same_file(written: Path, request) -> None:
    again = written.parents[1] / "again" / "bag"
    WRITERS[request.node.callspec.params["written"]](again)
    assert (again / "bag.mcap").read_bytes() == written.read_bytes()
    index = read_index(again)
    assert index["message_count"] == 2 * COUNT and index["custom_data"]["state"] == "whole"
