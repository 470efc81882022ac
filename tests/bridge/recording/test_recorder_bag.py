"""The bag without ROS: what stands on the disk, at every moment and after every kind of damage."""

import json
import random
import resource
import shutil
import struct
from pathlib import Path
from types import SimpleNamespace

import pytest
import yaml
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from support.recorder_bags import counts, data_file, index, with_mcap, with_rosbags

from pendulum_bridge.recording.definition import find_definition
from pendulum_bridge.recording.received_clock import ReceivedClock
from pendulum_bridge.recording.salvage import Salvage
from pendulum_bridge.recording.sequence_gaps import SequenceGaps
from pendulum_bridge.recording.session import FLUSH_S, Session
from pendulum_sysid.reading import bag_files
from pendulum_sysid.reading.mcap_stream import scan_mcap
from pendulum_twin.bags.bag import Bag
from pendulum_twin.bags.mcap_file import LARGEST_CHUNK
from pendulum_twin.bags.metadata import INDEX, read_index
from pendulum_twin.bags.records import Message, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest
from pendulum_twin.health import Level

QOS = {
    "history": "keep_last", "depth": 10, "reliability": "reliable", "durability": "volatile",
    "deadline": {"sec": 9223372036, "nsec": 854775807},
    "lifespan": {"sec": 9223372036, "nsec": 854775807},
    "liveliness": "automatic", "liveliness_lease_duration": {"sec": 9223372036, "nsec": 854775807},
    "avoid_ros_namespace_conventions": False,
}  # fmt: skip
HASH = "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"
COMMANDS = Topic("/rig/pwm", "std_msgs/msg/Float64", "float64 data\n", HASH, (QOS,))
TEXTS = Topic("/note", "std_msgs/msg/String", "string data\n")
CDR = bytes([0, 1, 0, 0])  # little-endian
START_NS = 1_700_000_000_000_000_000


def command(k: int) -> Message:
    return Message(
        "/rig/pwm", START_NS + k * 10_000_000, START_NS + k, k + 1, CDR + struct.pack("<d", k)
    )


def text(k: int, size: int) -> Message:
    return Message(
        "/note",
        START_NS + k * 10_000_000,
        0,
        0,
        CDR + struct.pack("<I", size + 1) + b"x" * size + b"\0",
    )


def new_bag(folder: Path, **options) -> Bag:
    bag = Bag(folder, **{"started_ns": START_NS, **options})
    bag.add_topic(COMMANDS)
    bag.add_topic(TEXTS)
    return bag


def fill(bag: Bag, numbers, batch: int = 7) -> None:
    for k in numbers:
        bag.keep(command(k))
        if k % batch == batch - 1:
            bag.flush()


def chunk_sizes(folder: Path) -> list[int]:
    with data_file(folder).open("rb") as stream:
        records = StreamReader(stream, emit_chunks=True).records
        return [r.uncompressed_size for r in records if type(r).__name__ == "Chunk"]


@pytest.mark.parametrize("compression", ["none", "zstd"])
def test_every_message_comes_back_in_every_reader(tmp_path: Path, compression: str) -> None:
    bag = new_bag(tmp_path / "run", compression=compression)
    fill(bag, range(100))
    bag.close()
    wanted = [(m.topic, m.received_ns, m.data) for m in map(command, range(100))]
    for read in (with_rosbags, with_mcap):
        result = read(tmp_path / "run")
        assert [(m.topic, m.received_ns, m.data) for m in result] == wanted
        assert [m.decoded.data for m in result] == list(range(100))
    assert counts(tmp_path / "run") == {"/rig/pwm": 100, "/note": 0}


def test_the_index_is_version_9_and_keeps_the_custom_data(tmp_path: Path) -> None:
    custom = {
        "twin": "rig:\n  mass: 1 # kg\n\n  other: 'x'\n",
        "note": "größer: 3 \\n %",
        "number": "60.0",
        "odd": " a\n\tb ",
    }
    bag = new_bag(tmp_path / "run", custom=custom)
    fill(bag, range(50))
    bag.close()
    result = index(tmp_path / "run")
    assert (result["version"], result["storage_identifier"], result["message_count"]) == (
        9,
        "mcap",
        50,
    )
    assert result["starting_time"]["nanoseconds_since_epoch"] == START_NS
    assert result["duration"]["nanoseconds"] == 490_000_000
    assert result["relative_file_paths"] == ["run_0.mcap"]
    metadata = result["topics_with_message_count"][0]["topic_metadata"]
    assert metadata["offered_qos_profiles"] == [QOS]
    kept = result["custom_data"]
    assert {key: kept[key] for key in custom} == custom and all(
        isinstance(message, str) for message in kept.values()
    )
    assert (
        kept["state"] == "whole"
        and json.loads(kept["messages"]) == {"/rig/pwm": 50}
        and kept["seconds"] == "0.490"
    )


def test_the_digest_is_the_one_that_a_verdict_carries(tmp_path: Path) -> None:
    bag = new_bag(tmp_path / "run")
    fill(bag, range(20))
    bag.close()
    digest = index(tmp_path / "run")["custom_data"]["digest"]
    assert digest == compute_digest([data_file(tmp_path / "run")])
    assert digest == compute_digest(bag_files.find_files(tmp_path / "run").files)


def test_the_data_file_knows_the_settings_by_itself(tmp_path: Path) -> None:
    bag = new_bag(tmp_path / "run", custom={"note": "alone"})
    fill(bag, range(7))
    salvage = Salvage(data_file(tmp_path / "run"))
    list(salvage)
    assert salvage.custom["note"] == "alone" and not salvage.is_whole


def test_it_is_a_bag_from_the_first_moment(tmp_path: Path) -> None:
    bag = new_bag(tmp_path / "run")
    result = index(tmp_path / "run")
    assert (
        result["message_count"] == 0
        and result["starting_time"]["nanoseconds_since_epoch"] == START_NS
    )
    assert (
        result["custom_data"]["state"] == "recording"
        and data_file(tmp_path / "run").stat().st_size > 0
    )
    fill(bag, range(7))
    assert (
        len([m for m in Salvage(data_file(tmp_path / "run")) if isinstance(m, Message)]) == 7
    )  # never closed


def test_chunks_hold_at_most_64_kib_unless_one_message_is_larger(tmp_path: Path) -> None:
    bag = new_bag(tmp_path / "run")
    for k, size in enumerate([30_000] * 9 + [200_000] + [10] * 5000):
        bag.keep(text(k, size))
    bag.flush()
    bag.close()
    sizes = chunk_sizes(tmp_path / "run")
    assert [size for size in sizes if size > LARGEST_CHUNK] == [200_000 + 31 + 9]
    assert len(with_mcap(tmp_path / "run")) == 5010


def test_messages_of_a_flush_stand_in_the_order_of_receiving(tmp_path: Path) -> None:
    bag = new_bag(tmp_path / "run")
    numbers = list(range(40))
    random.Random(1).shuffle(numbers)
    for k in numbers:
        bag.keep(command(k))
    bag.close()
    assert [
        m.received_ns for m in Salvage(data_file(tmp_path / "run")) if isinstance(m, Message)
    ] == [command(k).received_ns for k in range(40)]


@pytest.fixture(scope="module", params=["none", "zstd"])
def closed(request, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("closed") / "run"
    bag = new_bag(folder, compression=request.param)
    fill(bag, range(70))
    bag.close()
    return folder


@settings(max_examples=100, deadline=None)
@given(data=st.data())
def test_a_file_cut_anywhere_keeps_all_before_the_cut(
    closed: Path, tmp_path_factory, data: st.DataObject
) -> None:
    full = data_file(closed).read_bytes()
    size = data.draw(st.integers(8, len(full) - 1))
    cut = tmp_path_factory.mktemp("cut") / "cut.mcap"
    cut.write_bytes(full[:size])
    salvage = Salvage(cut)
    result = [m for m in salvage if isinstance(m, Message)]
    assert result == [command(k) for k in range(len(result))]
    with data_file(closed).open("rb") as stream:
        chunks, least = StreamReader(stream, emit_chunks=True), 0
        for record in chunks.records:
            if type(record).__name__ == "Chunk" and chunks._stream.count <= size:
                least += 7
    assert least <= len(result) <= min(least + 7, 70)
    assert not salvage.is_whole
    sysid = scan_mcap(cut, {"/rig/pwm"}) if size > 8 else None
    if sysid is not None:
        assert [data for _, data in sysid.messages.get("/rig/pwm", [])] == [m.data for m in result]


@settings(max_examples=80, deadline=None)
@given(data=st.data())
def test_a_damaged_byte_never_passes_for_a_message(
    closed: Path, tmp_path_factory, data: st.DataObject
) -> None:
    content = bytearray(data_file(closed).read_bytes())
    at = data.draw(st.integers(8, len(content) - 1))
    content[at] ^= data.draw(st.integers(1, 255))
    damaged = tmp_path_factory.mktemp("damaged") / "damaged.mcap"
    damaged.write_bytes(content)
    salvage = Salvage(damaged)
    result = [m for m in salvage if isinstance(m, Message)]
    assert set(result) <= {command(k) for k in range(70)}
    assert not (salvage.is_whole and len(result) < 70)


def test_a_chunk_that_no_longer_passes_for_one_is_missed(closed: Path, tmp_path: Path) -> None:
    content = bytearray(data_file(closed).read_bytes())
    with data_file(closed).open("rb") as stream:
        content[make_reader(stream).get_summary().chunk_indexes[4].chunk_start_offset] = (
            0x80  # a kind of record unknown so far
        )
    (tmp_path / "a.mcap").write_bytes(content)
    salvage = Salvage(tmp_path / "a.mcap")
    assert len([m for m in salvage if isinstance(m, Message)]) == 63 and not salvage.is_whole


def test_a_disk_that_fails_at_the_end_is_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = new_bag(tmp_path / "run")
    fill(bag, range(7))

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(
        BadInputError,
        match=r"ends after 7 messages \(No space left on device\); they are readable",
    ):
        bag.close()
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == [INDEX, "run_0.mcap"]
    assert index(tmp_path / "run")["custom_data"]["state"] == "cut"


def test_wherever_the_disk_is_full_the_index_counts_what_is_readable(tmp_path: Path) -> None:
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    for room in range(1, 900, 31):  # a chunk of seven messages and its index are about 700 bytes
        bag = new_bag(tmp_path / f"run_{room}")
        fill(bag, range(14))
        resource.setrlimit(resource.RLIMIT_FSIZE, (bag.size_bytes + room, limits[1]))
        try:
            with pytest.raises(BadInputError, match="the recording ends after"):
                fill(bag, range(14, 42))
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        bag.close()
        readable = [m for m in Salvage(data_file(bag.folder)) if isinstance(m, Message)]
        assert counts(bag.folder)["/rig/pwm"] == bag.tally.total == len(readable)


def test_what_is_no_mcap_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.mcap").write_bytes(b"SQLite format 3")
    with pytest.raises(
        BadInputError, match="expected an mcap file, found one without its opening mark"
    ):
        list(Salvage(tmp_path / "a.mcap"))


def test_an_existing_folder_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "run").mkdir()
    with pytest.raises(BadInputError, match="recordings are not overwritten"):
        new_bag(tmp_path / "run")
    assert list((tmp_path / "run").iterdir()) == []


def test_an_impossible_place_is_refused_in_a_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(BadInputError, match="expected a place to write to, found Not a directory"):
        new_bag(tmp_path / "file" / "run")


def test_little_space_refuses_the_start_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(
        BadInputError,
        match=r"expected at least 1e\+09 MB free on the disk, found \d+ MB: make room",
    ):
        new_bag(tmp_path / "run", least_free_bytes=10**15)
    assert list(tmp_path.iterdir()) == []


def test_little_space_later_ends_a_whole_bag(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = new_bag(tmp_path / "run", least_free_bytes=1000)
    session = Session(bag, 0.0, 0.0)
    session.take([], [command(0)], {}, FLUSH_S)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: SimpleNamespace(free=999))
    session.take([], [command(1)], {}, 2 * FLUSH_S)
    assert session.ended and session.health([], 1.0).level == Level.ERROR
    session.take([], [command(2)], {}, 3 * FLUSH_S)
    with pytest.raises(BadInputError, match=r"expected at least 0\.001 MB free"):
        session.close()
    assert [m.decoded.data for m in with_rosbags(tmp_path / "run")] == [0.0, 1.0]
    assert index(tmp_path / "run")["custom_data"]["state"] == "whole"


def test_the_index_is_replaced_in_one_move(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = new_bag(tmp_path / "run")
    fill(bag, range(7))
    seen = []
    move = Path.replace
    monkeypatch.setattr(
        Path,
        "replace",
        lambda self, to: (
            seen.append((yaml.safe_load(self.read_text()), read_index(to.parent))),
            move(self, to),
        ),
    )
    bag.refresh()
    ((new, old),) = seen
    assert new["rosbag2_bagfile_information"]["message_count"] == 7 and old["message_count"] == 0
    assert sorted(p.name for p in (tmp_path / "run").iterdir()) == [INDEX, "run_0.mcap"]


def test_a_session_writes_four_times_a_second_and_ends_in_time(tmp_path: Path) -> None:
    bag = new_bag(tmp_path / "run")
    session = Session(bag, seconds=1.0, now_s=100.0)
    for k in range(50):  # nobody publishes for 0.5 s
        session.take([], [], {}, 100.0 + 0.01 * k)
    worst = 0
    for k in range(200):
        session.take([], [command(k)], {"/rig/pwm": 2}, 100.5 + 0.01 * k)
        worst = max(worst, k + 1 - bag.tally.total if not session.ended else 0)
    assert worst <= 26 and session.ended
    session.close()
    assert counts(tmp_path / "run")["/rig/pwm"] == 101
    assert json.loads(index(tmp_path / "run")["custom_data"]["dropped"]) == {"/rig/pwm": 2}


def test_health_says_what_is_wrong(tmp_path: Path) -> None:
    session = Session(new_bag(tmp_path / "run"), 0.0, 0.0)
    health = session.health(["/rig/pwm"], 1.0)
    assert (
        health.level == Level.WARN
        and health.sentence == "no message yet; nobody publishes /rig/pwm"
    )
    session.take([], [command(k) for k in range(300)], {"/rig/pwm": 0}, 3.0)
    health = session.health([], 3.0)
    assert (
        health.level == Level.OK
        and health.figures["messages"] == 300
        and health.figures["rate_hz"] == 150.0
    )
    session.take([], [], {"/rig/pwm": 4}, 4.0)
    health = session.health([], 4.0)
    assert (
        health.level == Level.WARN
        and health.sentence == "4 messages were dropped"
        and health.figures["dropped"] == 4
    )


def gaps(numbers, publishers: int) -> int:
    counted = SequenceGaps()
    for number in numbers:
        counted.take(number, publishers)
    return counted.dropped


def test_gaps_of_one_publisher_are_what_is_missing() -> None:
    assert gaps([1, 2, 3, 4], 1) == 0
    assert gaps([5, 6, 9, 10, 20], 1) == 2 + 9  # what was sent before the first is not counted
    assert gaps([1, 2, 1, 2, 3, 4], 2) == 0  # it was started anew


@given(
    st.lists(st.tuples(st.booleans(), st.booleans()), max_size=60),
    st.integers(1, 100),
    st.integers(1, 100),
)
@settings(max_examples=300)
def test_gaps_of_two_publishers_add_up(turns: list[tuple[bool, bool]], a: int, b: int) -> None:
    """Two publishers take turns and lose messages; both send before and after the losses."""
    assume(b != a + 1)  # else the second one's first message passes for the first one's next
    numbers, arrived = {True: a, False: b}, []
    both = [(True, False), (False, False)]
    for turn, lost in [*both, *turns, *both]:
        arrived += [] if lost else [numbers[turn]]
        numbers[turn] += 1
    arrived += [numbers[True], numbers[False]]
    assert gaps(arrived, 2) == sum(lost for _, lost in turns)


def test_simulated_time_is_that_of_the_last_clock_message() -> None:
    clock = ReceivedClock()
    assert clock.convert(10) is None
    clock.take(10, struct.pack("<4BiI", 0, 1, 0, 0, 3, 500))
    clock.take(20, struct.pack(">4BiI", 0, 0, 0, 0, 4, 0))
    assert [clock.convert(time_ns) for time_ns in (9, 10, 19, 20, 99)] == [
        None,
        3_000_000_500,
        3_000_000_500,
        4 * 10**9,
        4 * 10**9,
    ]
    clock.forget_before_last()
    assert clock.convert(15) is None and clock.convert(21) == 4 * 10**9


def test_a_definition_holds_every_type_in_it_once() -> None:
    pytest.importorskip("sensor_msgs")
    result = find_definition("sensor_msgs/msg/JointState")
    assert result.count("=" * 80) == 2
    assert result.index("MSG: std_msgs/Header\n") < result.index("MSG: builtin_interfaces/Time\n")
    assert "float64[] effort" in result
    assert (
        find_definition("diagnostic_msgs/msg/DiagnosticArray").count(
            "MSG: diagnostic_msgs/KeyValue"
        )
        == 1
    )
    assert (
        find_definition("no_such_msgs/msg/Thing") == find_definition("std_msgs/msg/NoSuch") == ""
    )
