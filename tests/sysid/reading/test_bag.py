"""Good bags are read whole; cut, damaged and wrong ones are reported."""

import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from mcap.reader import make_reader
from mcap.stream_reader import StreamReader
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.reading.bag import DEFINITIONS, read_bag, write_bag
from pendulum_twin.errors import BadInputError

STORE = get_typestore(Stores.ROS2_JAZZY)
JOINT_STATE, FLOAT64 = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"
START = 1_650_000_000_000_000_123
COUNT = 2000
TIMES = START + 10_000_000 * np.arange(COUNT)
CART, POLE, COMMAND = (np.sin(k + np.arange(COUNT) / 30) for k in range(3))


def state(
    stamp: int, names: Sequence[str], position: Sequence[float], velocity: Sequence[float] = ()
) -> bytes:
    header = STORE.types["std_msgs/msg/Header"](
        stamp=STORE.types["builtin_interfaces/msg/Time"](
            sec=int(stamp) // 10**9, nanosec=int(stamp) % 10**9
        ),
        frame_id="",
    )
    values = (np.array(v, dtype=np.float64) for v in (position, velocity, ()))
    message = STORE.types[JOINT_STATE](header, list(names), *values)
    return STORE.serialize_cdr(message, JOINT_STATE)


@pytest.mark.parametrize("name", DEFINITIONS)
def test_types_are_read_as_the_distribution_defines_them(name: str) -> None:
    own = get_typestore(Stores.EMPTY)
    for other, definition in DEFINITIONS.items():
        own.register(get_types_from_msg(definition, other))
    assert own.generate_msgdef(name) == STORE.generate_msgdef(name)


def number(value: float) -> bytes:
    return STORE.serialize_cdr(STORE.types[FLOAT64](data=value), FLOAT64)


def states(count: int = COUNT, names: Sequence[str] = ("cart", "pole")) -> list[tuple[int, bytes]]:
    of = {"cart": CART, "pole": POLE}
    return [
        (int(TIMES[k]), state(TIMES[k], names, [of[n][k] for n in names])) for k in range(count)
    ]


def commands(count: int = COUNT) -> list[tuple[int, bytes]]:
    return [(int(TIMES[k]), number(COMMAND[k])) for k in range(count)]


def write(
    path: Path,
    topics: dict[str, tuple[str, list[tuple[int, bytes]]]],
    plugin: StoragePlugin = StoragePlugin.MCAP,
    compression: CompressionMode = CompressionMode.NONE,
) -> Path:
    """Write messages as rosbags' own writer does, in order of time."""
    writer = Writer(path, version=9, storage_plugin=plugin)
    writer.set_compression(compression, CompressionFormat.ZSTD)
    with writer:
        merged = []
        for topic, (kind, messages) in topics.items():
            connection = writer.add_connection(topic, kind, typestore=STORE)
            merged += [(time, k, connection, data) for k, (time, data) in enumerate(messages)]
        for time, _, connection, data in sorted(merged, key=lambda m: m[:2]):
            writer.write(connection, time, data)
    return path


def both(count: int = COUNT) -> dict[str, tuple[str, list[tuple[int, bytes]]]]:
    return {
        "/rig/joint_states": (JOINT_STATE, states(count)),
        "/rig/pwm": (FLOAT64, commands(count)),
    }


def only_states(
    messages: list[tuple[int, bytes]],
) -> dict[str, tuple[str, list[tuple[int, bytes]]]]:
    return {"/rig/joint_states": (JOINT_STATE, messages), "/rig/pwm": (FLOAT64, commands())}


def check_whole(path: Path) -> None:
    raw = read_bag(path)
    np.testing.assert_array_equal(raw.cart, CART)
    np.testing.assert_array_equal(raw.pole, POLE)
    np.testing.assert_array_equal(raw.command, COMMAND)
    np.testing.assert_array_equal(raw.state_stamp_s, np.arange(COUNT) * 10_000_000 / 1e9)
    np.testing.assert_array_equal(raw.command_stamp_s, raw.state_stamp_s)
    assert (raw.lost_messages, raw.cut_short) == (0, False)


def test_what_is_written_is_read_back(tmp_path: Path) -> None:
    joints = {"cart": CART, "pole": POLE}
    write_bag(
        tmp_path / "deep" / "bag", TIMES, joints, COMMAND, velocities={"cart": POLE, "pole": CART}
    )
    check_whole(tmp_path / "deep" / "bag")
    raw = read_bag(tmp_path / "deep" / "bag")
    np.testing.assert_array_equal(raw.cart_velocity, POLE)
    np.testing.assert_array_equal(raw.pole_velocity, CART)
    assert raw.name == "bag"
    assert [p.name for p in (tmp_path / "deep").iterdir()] == ["bag"]


def test_the_bag_is_as_the_stock_tools_write_it(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", TIMES, {"pole": POLE, "cart": CART}, COMMAND)
    index = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())[
        "rosbag2_bagfile_information"
    ]
    assert (index["version"], index["storage_identifier"], index["message_count"]) == (
        9,
        "mcap",
        2 * COUNT,
    )
    with Reader(tmp_path / "bag") as reader:
        assert {c.topic: c.msgtype for c in reader.connections} == {
            "/rig/joint_states": JOINT_STATE,
            "/rig/pwm": FLOAT64,
        }
    with (tmp_path / "bag" / index["relative_file_paths"][0]).open("rb") as stream:
        schemas = [r for r in StreamReader(stream).records if type(r).__name__ == "Schema"]
    assert {s.encoding for s in schemas} == {"ros2msg"}
    check_whole(tmp_path / "bag")


def test_the_digest_is_that_of_the_data_file(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", TIMES, {"cart": CART}, COMMAND)
    data = (tmp_path / "bag" / "bag.mcap").read_bytes()
    assert read_bag(tmp_path / "bag").digest == f"sha256:{hashlib.sha256(data).hexdigest()}"


@pytest.mark.parametrize("plugin", list(StoragePlugin))
@pytest.mark.parametrize(
    "compression", [CompressionMode.NONE, CompressionMode.FILE, CompressionMode.MESSAGE]
)
def test_bags_of_other_writers_are_read(
    tmp_path: Path, plugin: StoragePlugin, compression: CompressionMode
) -> None:
    check_whole(write(tmp_path / "bag", both(), plugin, compression))


def test_chunks_packed_by_zstd_are_read(tmp_path: Path) -> None:
    check_whole(write(tmp_path / "bag", both(), compression=CompressionMode.STORAGE))


def edit_index(path: Path, change: Callable[[dict[str, Any]], object]) -> None:
    file = path / "metadata.yaml"
    whole = yaml.safe_load(file.read_text())
    change(whole["rosbag2_bagfile_information"])
    file.write_text(yaml.safe_dump(whole))


def forget_details(index: dict[str, Any]) -> None:
    """Leave what `ros2 bag reindex` leaves: no list of files, another form of QoS."""
    index["files"] = []
    for entry in index["topics_with_message_count"]:
        entry["topic_metadata"]["offered_qos_profiles"] = (
            "- history: 1\n  depth: 10\n  reliability: 1"
        )


def test_a_command_that_was_received_late_counts_from_when_it_was_published(
    tmp_path: Path,
) -> None:
    bag, late = write(tmp_path / "bag", both()), tmp_path / "late.mcap"
    random = np.random.default_rng(1)
    (file,) = bag.glob("*.mcap")
    with file.open("rb") as source, late.open("wb") as target:
        writer = McapWriter(target)
        writer.start(profile="ros2")
        channels = {}
        for schema, channel, message in make_reader(source).iter_messages():
            if channel.topic not in channels:
                kind = writer.register_schema(schema.name, schema.encoding, schema.data)
                channels[channel.topic] = writer.register_channel(channel.topic, "cdr", kind)
            received = message.log_time + 2_000_000 + int(random.integers(0, 9_000_000))
            writer.add_message(channels[channel.topic], received, message.data, message.log_time)
        writer.finish()
    read, whole = read_bag(late), read_bag(bag)
    off = read.command_stamp_s - whole.command_stamp_s
    assert np.ptp(off) < 1e-9 and 0.002 <= off[0] < 0.0021
    assert np.array_equal(read.command, whole.command)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_reindexed_bag_is_read(tmp_path: Path, plugin: StoragePlugin) -> None:
    path = write(tmp_path / "bag", both(), plugin)
    edit_index(path, forget_details)
    check_whole(path)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_bag_without_index_and_a_bare_file_are_read(
    tmp_path: Path, plugin: StoragePlugin
) -> None:
    path = write(tmp_path / "bag", both(), plugin)
    (path / "metadata.yaml").unlink()
    check_whole(path)
    check_whole(next(path.iterdir()))


def test_a_bag_in_several_files_is_read(tmp_path: Path) -> None:
    half = {t: (kind, messages[: COUNT // 2]) for t, (kind, messages) in both().items()}
    rest = {t: (kind, messages[COUNT // 2 :]) for t, (kind, messages) in both().items()}
    path, second = write(tmp_path / "b", half), write(tmp_path / "a", rest)
    (second / "a.mcap").rename(path / "a.mcap")

    def name_both(index: dict[str, Any]) -> None:
        index["relative_file_paths"] = ["b.mcap", "a.mcap"]
        for entry in index["topics_with_message_count"]:
            entry["message_count"] = COUNT

    edit_index(path, name_both)
    check_whole(path)
    (path / "a.mcap").unlink()
    raw = read_bag(path)
    assert (len(raw.state_stamp_s), raw.lost_messages) == (COUNT // 2, COUNT)


PLAIN, PACKED = CompressionMode.NONE, CompressionMode.STORAGE


@pytest.mark.parametrize(
    ("kept", "packed"),
    [
        (0.999, PLAIN),
        (0.9, PLAIN),
        (0.5, PLAIN),
        (0.1, PLAIN),
        (0.999, PACKED),
        (0.9, PACKED),
        (0.5, PACKED),
    ],
)
def test_a_cut_file_is_read_as_far_as_it_goes(
    tmp_path: Path, kept: float, packed: CompressionMode
) -> None:
    path = write(tmp_path / "bag", both(), compression=packed)
    file = path / "bag.mcap"
    data = file.read_bytes()
    file.write_bytes(data[: int(kept * len(data))])
    raw = read_bag(path)
    read = len(raw.state_stamp_s)
    assert read >= 0.6 * kept * COUNT if packed is PLAIN else read > 0
    np.testing.assert_array_equal(raw.cart, CART[:read])
    assert raw.lost_messages == 2 * COUNT - read - len(raw.command)
    assert raw.cut_short == (raw.lost_messages > 0)
    bare = read_bag(file)
    assert len(bare.state_stamp_s) == read
    assert bare.cut_short or kept > 0.99  # the index at the end may be whole


def test_a_file_that_is_cut_after_a_few_samples_is_to_be_copied_again(tmp_path: Path) -> None:
    """Each says so: no messages of a topic, a single sample, and too few samples to clean."""
    file = write(tmp_path / "bag", both()) / "bag.mcap"
    whole, said = file.read_bytes(), []
    for length in (700, *range(800, 3000, 20), len(whole) // 40):
        file.write_bytes(whole[:length])
        try:
            clean_recording(read_bag(file))
        except BadInputError as error:
            said.append(str(error))
    ends = "in a file that is cut off or damaged: copy it again"
    for words in ("found none", "found 1", "usable samples"):
        assert any(words in sentence and ends in sentence for sentence in said), (words, said)


def test_a_file_that_ends_in_zeros_is_read_up_to_them(tmp_path: Path) -> None:
    file = write(tmp_path / "bag", both()) / "bag.mcap"
    data = file.read_bytes()
    file.write_bytes(data[: len(data) // 2] + bytes(100_000))
    raw = read_bag(tmp_path / "bag")
    assert 0 < len(raw.state_stamp_s) < COUNT
    assert raw.lost_messages > 0


@pytest.mark.parametrize("indexed", [True, False])
def test_a_damaged_chunk_is_left_out_and_reported(tmp_path: Path, indexed: bool) -> None:
    path = write(
        tmp_path / "bag", {**both(), "/padding": (FLOAT64, [(int(t), bytes(900)) for t in TIMES])}
    )
    if not indexed:
        (path / "metadata.yaml").unlink()
    file = path / "bag.mcap"
    data = bytearray(file.read_bytes())
    chunk = 17 + int.from_bytes(data[9:17], "little")  # after the mark and the header
    assert data[chunk] == 6
    data[chunk + 9 + 16] ^= 1  # its size, after opcode, length and two times
    file.write_bytes(data)
    raw = read_bag(path)
    read = len(raw.state_stamp_s)
    assert 0 < read < COUNT
    np.testing.assert_array_equal(raw.cart, CART[-read:])
    assert raw.lost_messages == 2 * COUNT - read - len(raw.command)


def test_an_index_that_counts_more_than_there_is_is_reported(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", both())

    def count_more(index: dict[str, Any]) -> None:
        index["topics_with_message_count"][0]["message_count"] += 7

    edit_index(path, count_more)
    raw = read_bag(path)
    assert (raw.lost_messages, raw.cut_short) == (7, False)


@pytest.mark.parametrize("names", [("pole", "cart"), ("cart",), ("wheel", "pole", "cart")])
def test_joints_are_found_by_name(tmp_path: Path, names: tuple[str, ...]) -> None:
    of = {"cart": CART, "pole": POLE, "wheel": COMMAND}
    messages = [
        (int(TIMES[k]), state(TIMES[k], names, [of[n][k] for n in names])) for k in range(COUNT)
    ]
    raw = read_bag(write(tmp_path / "bag", only_states(messages)))
    np.testing.assert_array_equal(raw.cart, CART)
    if "pole" in names:
        np.testing.assert_array_equal(raw.pole, POLE)
    else:
        assert raw.pole is None


def test_a_pole_alone_needs_no_command(tmp_path: Path) -> None:
    raw = read_bag(
        write(tmp_path / "bag", {"/rig/joint_states": (JOINT_STATE, states(names=["pole"]))})
    )
    assert raw.cart is None
    assert len(raw.command) == 0
    np.testing.assert_array_equal(raw.pole, POLE)


def test_other_topics_can_be_named(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", {"/a": (JOINT_STATE, states()), "/b": (FLOAT64, commands())})
    assert len(read_bag(path, "/a", "/b").command) == COUNT


def test_a_short_message_counts_as_missing(tmp_path: Path) -> None:
    messages = states()
    messages[10] = (messages[10][0], state(TIMES[10], ["cart", "pole"], [0.5]))
    messages[11] = (messages[11][0], state(TIMES[11], ["cart", "pole"], []))
    raw = read_bag(write(tmp_path / "bag", only_states(messages)))
    assert raw.pole is not None
    assert raw.cart is not None
    assert np.flatnonzero(np.isnan(raw.pole)).tolist() == [10, 11]
    assert np.flatnonzero(np.isnan(raw.cart)).tolist() == [11]


def test_a_message_that_cannot_be_decoded_is_counted_as_lost(tmp_path: Path) -> None:
    messages = states()
    messages[10] = (messages[10][0], b"\x00\x01\x00\x00\x01")
    raw = read_bag(write(tmp_path / "bag", only_states(messages)))
    assert (len(raw.state_stamp_s), raw.lost_messages) == (COUNT - 1, 1)


def refusal(path: Path, *topics: str) -> str:
    with pytest.raises(BadInputError) as caught:
        read_bag(path, *topics)
    sentence = str(caught.value)
    assert sentence.startswith(f"{path}: expected ")
    assert "\n" not in sentence
    return sentence.removeprefix(f"{path}: ")


def test_a_path_that_holds_no_bag_is_refused(tmp_path: Path) -> None:
    assert "found nothing there" in refusal(tmp_path / "none")
    assert "found a folder without .mcap or .db3 files" in refusal(tmp_path)
    (tmp_path / "notes.txt").write_text("x")
    assert "found notes.txt: turn it into a recording with sysid import" in refusal(
        tmp_path / "notes.txt"
    )
    (tmp_path / "notes.mcap").write_text("these are no messages")
    assert "without its opening mark" in refusal(tmp_path / "notes.mcap")
    (tmp_path / "notes.db3").write_text("these are no messages")
    assert "cut or damaged" in refusal(tmp_path / "notes.db3")
    (tmp_path / "empty.mcap").touch()
    assert "found empty.mcap empty (0 bytes)" in refusal(tmp_path / "empty.mcap")


def test_a_folder_with_an_index_only_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", both(10))
    (path / "bag.mcap").unlink()
    assert "metadata.yaml without its data files" in refusal(path)


@pytest.mark.parametrize("plugin", list(StoragePlugin))
def test_a_file_cut_at_its_beginning_is_refused(tmp_path: Path, plugin: StoragePlugin) -> None:
    path = write(tmp_path / "bag", both(), plugin)
    file = next(p for p in path.iterdir() if p.suffix in (".mcap", ".db3"))
    file.write_bytes(file.read_bytes()[:60])
    assert "cut" in refusal(path)


def test_a_missing_topic_is_refused_with_those_that_are_there(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", both(10))
    sentence = refusal(path, "/twin/joint_states")
    assert "expected the topic /twin/joint_states, found /rig/joint_states, /rig/pwm" in sentence
    assert sentence.endswith(": give --state-topic /rig/joint_states")
    sentence = refusal(path, "/rig/joint_states", "/twin/pwm")
    assert sentence.endswith(": give --command-topic /rig/pwm")


def test_a_missing_command_is_refused_with_the_topics_that_hold_commands(tmp_path: Path) -> None:
    """Those that hold messages; as of a recording of the driver's topics alone."""
    topics = {
        "/rig/joint_states": (JOINT_STATE, states()),
        "/rig/applied_pwm": (FLOAT64, commands()),
        "/rig/pwm": (FLOAT64, []),
    }
    quiet = write(tmp_path / "quiet", topics)
    assert refusal(quiet).endswith(
        "found none: record again, or give --command-topic /rig/applied_pwm"
    )
    del topics["/rig/pwm"]
    alone = write(tmp_path / "alone", topics)
    assert refusal(alone).endswith("/rig/joint_states: give --command-topic /rig/applied_pwm")
    more = topics | {f"/motor_{k}": (FLOAT64, commands()) for k in range(2)}
    sentence = refusal(write(tmp_path / "more", more))
    assert sentence.endswith("give --command-topic /motor_0 or /motor_1 or /rig/applied_pwm")


def test_a_topic_of_another_type_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", both(10))
    assert f"expected {JOINT_STATE} on /rig/pwm, found {FLOAT64}" in refusal(path, "/rig/pwm")
    sentence = refusal(path, "/rig/joint_states", "/rig/joint_states")
    assert f"expected {FLOAT64} on /rig/joint_states" in sentence


def test_a_topic_without_messages_is_refused(tmp_path: Path) -> None:
    assert "expected messages on /rig/joint_states, found none" in refusal(
        write(tmp_path / "a", only_states([]))
    )
    quiet = {"/rig/joint_states": (JOINT_STATE, states()), "/rig/pwm": (FLOAT64, [])}
    assert "expected messages on /rig/pwm, found none" in refusal(write(tmp_path / "b", quiet))


def test_messages_without_our_joints_are_refused(tmp_path: Path) -> None:
    strange = [(int(t), state(t, ["slider", "arm"], [0.0, 0.0])) for t in TIMES]
    assert "found slider, arm" in refusal(write(tmp_path / "a", only_states(strange)))
    empty = [(int(t), state(t, ["cart", "pole"], [])) for t in TIMES]
    assert "expected positions of joints named cart or pole" in refusal(
        write(tmp_path / "b", only_states(empty))
    )


def test_a_cart_without_commands_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path / "bag", {"/rig/joint_states": (JOINT_STATE, states())})
    assert refusal(path) == (
        "expected the topic /rig/pwm, found /rig/joint_states: record again, for no other topic "
        "holds std_msgs/msg/Float64"
    )


def test_one_message_is_refused(tmp_path: Path) -> None:
    assert "expected a recording of many samples, found 1" in refusal(
        write(tmp_path / "bag", both(1))
    )


def test_a_clock_that_was_set_back_is_refused(tmp_path: Path) -> None:
    messages = [
        (int(t), state(t - 25_000_000 * (k > 1000), ["cart"], [CART[k]]))
        for k, t in enumerate(TIMES)
    ]
    sentence = refusal(write(tmp_path / "bag", only_states(messages)))
    assert "run backwards by 0.015 s after sample 1000 (10 s from the start)" in sentence


def test_messages_out_of_order_by_stamp_or_arrival_are_left_out_and_counted(
    tmp_path: Path,
) -> None:
    messages = states()
    messages[50], messages[51] = (
        (messages[50][0], messages[51][1]),
        (messages[51][0], messages[50][1]),
    )
    messages[700] = (messages[700][0], state(TIMES[700] + 10**12, ["cart"], [CART[700]]))
    messages[900] = (messages[900][0] - 10**9, messages[900][1])
    raw = read_bag(write(tmp_path / "bag", only_states(messages)))
    assert raw.lost_messages == 3 and len(raw.state_stamp_s) == COUNT - 3
    at = np.rint(raw.state_stamp_s / 0.01).astype(int)
    np.testing.assert_array_equal(raw.positions["cart"], CART[at])
    (gap,) = [f for f in clean_recording(raw).findings if f.kind == "gap"]
    assert "missing, unreadable or out of order: 3" in gap.note


def test_messages_that_are_not_stamped_are_refused(tmp_path: Path) -> None:
    messages = [(int(t), state(0, ["cart"], [0.0])) for t in TIMES]
    quiet = {**only_states(messages), "/rig/pwm": (FLOAT64, [(k, number(0.0)) for k in range(9)])}
    assert "the same time in all 2000 messages" in refusal(write(tmp_path / "bag", quiet))


def test_commands_on_another_clock_are_refused(tmp_path: Path) -> None:
    messages = [(int(t), state(t - START, ["cart"], [0.0])) for t in TIMES]
    sentence = refusal(write(tmp_path / "bag", only_states(messages)))
    assert "found them all 1.65e+09 s after the last stamp" in sentence


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_few_values_that_are_not_finite_are_missing_and_many_are_refused(
    tmp_path: Path, value: float
) -> None:
    cart = CART.copy()
    cart[100:120] = value
    write_bag(tmp_path / "few", TIMES, {"cart": cart}, COMMAND)
    raw = read_bag(tmp_path / "few")
    assert raw.cart is not None
    assert np.flatnonzero(np.isnan(raw.cart)).tolist() == list(range(100, 120))
    cart[100:320] = value
    write_bag(tmp_path / "many", TIMES, {"cart": cart}, COMMAND)
    assert "expected finite values of cart, found 220 of 2000 missing" in refusal(
        tmp_path / "many"
    )


def test_nothing_is_overwritten_and_nothing_half_written_is_left(tmp_path: Path) -> None:
    write_bag(tmp_path / "bag", TIMES, {"cart": CART}, COMMAND)
    with pytest.raises(BadInputError, match="found it there already"):
        write_bag(tmp_path / "bag", TIMES, {"cart": CART}, COMMAND)
    with pytest.raises(ValueError, match="expected a time for each command"):
        write_bag(tmp_path / "other", TIMES, {"cart": CART}, COMMAND[:-1])
    assert [p.name for p in tmp_path.iterdir()] == ["bag"]


def test_the_real_rig_s_bag_is_read(shared_data: Path) -> None:
    raw = read_bag(shared_data / "inteco_rig" / "open_loop_0_60s")
    assert (len(raw.state_stamp_s), len(raw.command), raw.lost_messages) == (6000, 6000, 0)
    assert raw.state_stamp_s[-1] == 59.99
