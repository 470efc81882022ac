"""Files that are damaged or made to do harm: bounded, counted, refused in a sentence."""

import struct
import zlib
from pathlib import Path

import numpy as np
import pytest
import zstandard

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.errors import FileError
from pendulum_sysid.reading import contents, unpacking
from pendulum_sysid.reading.bag import read_bag, write_bag
from pendulum_sysid.reading.bag_files import find_files
from pendulum_sysid.reading.mcap_stream import CHUNK, CHUNK_HEAD_BYTES, MAGIC, MESSAGE

COUNT = 20_000  # samples: several chunks
STAMPS = 10**18 + 10_000_000 * np.arange(COUNT)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("signed") / "bag"
    t = 0.01 * np.arange(COUNT)
    write_bag(path, STAMPS, {"cart": 0.1 * np.sin(t), "pole": 3 + np.cos(t)}, 0.1 * np.cos(t))
    return path


def list_chunks(data: bytes) -> list[tuple[int, int]]:
    """Return (begin, end) of the content of each chunk record."""
    chunks, position = [], len(MAGIC)
    while position + 9 <= len(data) - len(MAGIC):
        opcode, size = struct.unpack_from("<BQ", data, position)
        if opcode == CHUNK:
            chunks.append((position + 9, position + 9 + size))
        position += 9 + size
    return chunks


def test_our_recordings_are_signed_and_both_topics_stand_in_each_chunk(bag: Path) -> None:
    data = next(bag.glob("*.mcap")).read_bytes()
    chunks = list_chunks(data)
    assert len(chunks) > 2
    for begin, end in chunks:
        crc = struct.unpack_from("<I", data, begin + 24)[0]
        assert crc == zlib.crc32(data[begin + 40 : end]) != 0
    whole = read_bag(bag)
    assert (len(whole.state_stamp_s), len(whole.command), whole.damaged_parts) == (COUNT, COUNT, 0)


@pytest.mark.parametrize("place", [0.1, 0.5, 0.9])
def test_a_flipped_bit_costs_its_chunk_and_is_said(
    bag: Path, tmp_path: Path, place: float
) -> None:
    data = bytearray(next(bag.glob("*.mcap")).read_bytes())
    begin, end = list_chunks(bytes(data))[1]
    data[round(begin + 40 + place * (end - begin - 40))] ^= 1
    path = tmp_path / "flipped.mcap"
    path.write_bytes(data)
    raw = read_bag(path)
    assert raw.damaged_parts == 1 and COUNT / 2 < len(raw.state_stamp_s) < COUNT
    [gap] = [f for f in clean_recording(raw).findings if f.kind == "gap"]
    assert "parts of the file that are damaged and left out: 1" in gap.note


@pytest.mark.parametrize("time_ns", [2**63, 2**64 - 1])
def test_a_message_with_a_time_beyond_all_clocks_is_damaged(
    bag: Path, tmp_path: Path, time_ns: int
) -> None:
    data = bytearray(next(bag.glob("*.mcap")).read_bytes())
    begin, end = list_chunks(bytes(data))[1]
    struct.pack_into("<I", data, begin + 24, 0)  # a chunk without a checksum
    position = begin + CHUNK_HEAD_BYTES
    while data[position] != MESSAGE:
        position += 9 + struct.unpack_from("<Q", data, position + 1)[0]
    assert position < end
    struct.pack_into("<Q", data, position + 9 + 6, time_ns)
    path = tmp_path / "late.mcap"
    path.write_bytes(data)
    raw = read_bag(path)
    assert raw.damaged_parts == 1
    assert len(raw.state_stamp_s) + len(raw.command) == 2 * COUNT - 1


def test_a_cut_file_holds_commands_as_far_as_samples(bag: Path, tmp_path: Path) -> None:
    data = next(bag.glob("*.mcap")).read_bytes()
    path = tmp_path / "cut.mcap"
    path.write_bytes(data[: len(data) // 2])
    raw = read_bag(path)
    assert abs(raw.state_stamp_s[-1] - raw.command_stamp_s[-1]) < 0.05


def test_a_packed_file_is_not_unpacked_beyond_all_measure(tmp_path: Path) -> None:
    packed = zstandard.ZstdCompressor().compress(bytes(1 << 28))
    path = tmp_path / "bomb.mcap.zstd"
    path.write_bytes(packed)
    assert len(packed) < 20_000
    with pytest.raises(FileError, match="expands to more than 200 times its size"):
        read_bag(path)


def test_a_chunk_is_unpacked_to_the_size_that_it_declares() -> None:
    packed = zstandard.ZstdCompressor().compress(bytes(1 << 24))
    assert len(unpacking.unpack_zstd(packed, 1000)) == 1001
    assert unpacking.unpack_message(packed) == b""


def test_a_chunk_that_declares_gigabytes_is_damaged(tmp_path: Path) -> None:
    packed = zstandard.ZstdCompressor().compress(bytes(1 << 24))
    body = struct.pack("<QQQI", 0, 0, 1 << 40, 0) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(packed)) + packed
    path = tmp_path / "large.mcap"
    path.write_bytes(MAGIC + struct.pack("<BQ", CHUNK, len(body)) + body + MAGIC)
    with pytest.raises(FileError, match="cut before its first message"):
        read_bag(path)


def test_huge_messages_are_no_joint_states() -> None:
    kept = contents.Contents({"/rig/pwm"})
    kept.add("/rig/pwm", 0, bytes(unpacking.MOST_MESSAGE_BYTES + 1))
    kept.add("/rig/pwm", 1, bytes(16))
    assert [time for time, _ in kept.messages["/rig/pwm"]] == [1]


@pytest.mark.parametrize(
    "index",
    [
        "[" * 5000,
        "a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n",
        "rosbag2_bagfile_information: {relative_file_paths: 3, compression_mode: [1]}",
        "rosbag2_bagfile_information: {relative_file_paths: [{}, 7, null]}",
        "rosbag2_bagfile_information: {topics_with_message_count: {a: b}}",
        "rosbag2_bagfile_information: {topics_with_message_count: [1, {topic_metadata: 2}]}",
        "rosbag2_bagfile_information: {starting_time: 2026-13-45, topics_with_message_count: "
        "[{topic_metadata: {name: /rig/pwm}, message_count: 1e300}]}",
        "rosbag2_bagfile_information: " + "x" * 20_000_000,
    ],
    ids=["brackets", "aliases", "types", "entries", "counts", "count", "date", "size"],
)
def test_an_index_that_is_none_is_left_aside(bag: Path, tmp_path: Path, index: str) -> None:
    file = next(bag.glob("*.mcap"))
    (tmp_path / file.name).symlink_to(file)
    (tmp_path / "metadata.yaml").write_text(index)
    found = find_files(tmp_path)
    assert [path.name for path in found.files] == [file.name] and found.counted == {}


def test_a_file_that_an_index_names_twice_is_read_once(bag: Path, tmp_path: Path) -> None:
    file = next(bag.glob("*.mcap"))
    (tmp_path / file.name).symlink_to(file)
    (tmp_path / "metadata.yaml").write_text(
        "rosbag2_bagfile_information: {relative_file_paths: "
        f"[{file.name}, {file.name}, old/{file.name}]}}"
    )
    assert find_files(tmp_path).files == (tmp_path / file.name,)
