"""The recorder on real topics: every reader reads every message, and drops are counted."""

import json
import math
import random
import resource
import signal
import struct
import time
from pathlib import Path

import numpy as np
import pytest

rclpy = pytest.importorskip("rclpy")
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue  # noqa: E402
from rclpy.duration import Duration  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy  # noqa: E402
from rclpy.serialization import deserialize_message  # noqa: E402
from rosbags.rosbag2 import Reader  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import JointState  # noqa: E402
from std_msgs.msg import Bool, Float64, String  # noqa: E402
from support.paths import CONFIG  # noqa: E402
from support.recorder_bags import counts, data_file, index, with_mcap, with_rosbags  # noqa: E402
from support.ros_graph import Graph, until  # noqa: E402

from pendulum_bridge.nodes.raw_topics import RawTopics  # noqa: E402
from pendulum_bridge.nodes.recorder_node import RecorderNode  # noqa: E402
from pendulum_bridge.recording.recover import recover  # noqa: E402
from pendulum_sysid.cli import main as sysid  # noqa: E402
from pendulum_sysid.reading.bag import read_bag  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402

LONGEST_END_S = 600.0  # only a program that is stuck takes so long
MODULE = "pendulum_bridge.nodes.recorder_node"
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
HURRIED = QoSProfile(depth=10, reliability=ReliabilityPolicy.BEST_EFFORT)


def recorder(ros: Graph, out: Path, **values: object) -> RecorderNode:
    return ros.add(RecorderNode, out=str(out), **values)


def connect(ros: Graph, *publishers: object, readers: int = 1) -> None:
    ros.until(
        lambda: all(p.get_subscription_count() >= readers for p in publishers),
        "the recorder's subscriptions",
    )


def recorded(node: RecorderNode, topic: str) -> int:
    return node._session._bag.tally.messages.get(topic, 0)


def finish(ros: Graph, node: RecorderNode, **wanted: int) -> None:
    """Wait for so many messages of each topic in the bag, and close it."""
    ros.until(
        lambda: all(recorded(node, f"/{topic}") >= n for topic, n in wanted.items()),
        f"{wanted} in the bag",
    )
    node.finish()


def state(k: int, rng: random.Random) -> JointState:
    """Return a sample stamped now; some have NaN as velocity, some a frame with umlauts."""
    turn = math.nan if k % 40 == 7 else rng.gauss(0, 9)
    message = JointState(
        name=["cart", "pole"],
        position=[rng.gauss(0, 1), math.pi],
        velocity=[rng.gauss(0, 1), turn],
    )
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(time.time_ns(), 10**9)
    message.header.frame_id = "größe" if k % 3 else ""
    return message


def health(k: int) -> DiagnosticArray:
    status = DiagnosticStatus(
        level=b"\1", name="n", message="m", values=[KeyValue(key="k", value=str(k))]
    )
    return DiagnosticArray(status=[status] * (k % 4))


def test_every_message_is_equal_in_three_readers(ros: Graph, tmp_path: Path) -> None:
    user, rng = ros.user(), random.Random(3)
    states = user.create_publisher(JointState, "/rig/joint_states", 10)
    commands = user.create_publisher(Float64, "/rig/pwm", 10)
    healths = user.create_publisher(DiagnosticArray, "/health", 10)
    stopped = user.create_publisher(Bool, "/rig/stopped", LATCHED)
    stopped.publish(Bool(data=True))  # before the recorder is there
    names = ["/rig/joint_states", "/rig/pwm", "/health", "/rig/stopped"]
    node = recorder(ros, tmp_path / "run", topics=names, compression="zstd")
    connect(ros, states, commands, healths)
    sent = {
        "/rig/joint_states": [],
        "/rig/pwm": [],
        "/health": [],
        "/rig/stopped": [Bool(data=True)],
    }
    for k in range(200):
        for publisher, message in (
            (states, state(k, rng)),
            (commands, Float64(data=rng.gauss(0, 1))),
            (healths, health(k)),
        ):
            publisher.publish(message)
            sent[publisher.topic_name].append(message)
        if k % 20 == 0:
            ros.spin()
    ros.until(
        lambda: all(recorded(node, name) == len(sent[name]) for name in names),
        "all messages in the bag",
    )
    node.finish()
    by_rosbags, by_mcap = with_rosbags(tmp_path / "run"), with_mcap(tmp_path / "run")
    assert sorted(m[:3] for m in by_rosbags) == sorted(m[:3] for m in by_mcap)
    for read in (by_rosbags, by_mcap):
        for name, messages in sent.items():
            received = [message for message in read if message.topic == name]
            unpacked = [deserialize_message(m.data, type(messages[0])) for m in received]
            assert list(map(str, unpacked)) == list(
                map(str, messages)
            )  # as text, so that NaN equals NaN
            if name == "/rig/joint_states":
                same = zip(received, messages, strict=True)
                assert all(
                    np.array_equal(f.decoded.velocity, m.velocity, equal_nan=True) for f, m in same
                )
                assert [f.decoded.header.frame_id for f in received] == [
                    m.header.frame_id for m in messages
                ]
            if name == "/health":
                assert [[s.values[0].value for s in f.decoded.status] for f in received] == [
                    [s.values[0].value for s in m.status] for m in messages
                ]
    raw = read_bag(tmp_path / "run")
    assert np.array_equal(raw.cart, [m.position[0] for m in sent["/rig/joint_states"]])
    assert np.array_equal(raw.command, [m.data for m in sent["/rig/pwm"]])
    assert (raw.lost_messages, raw.cut_short) == (0, False)
    assert raw.digest == index(tmp_path / "run")["custom_data"]["digest"]
    with Reader(tmp_path / "run") as reader:
        offered = {c.topic: c.ext.offered_qos_profiles[0] for c in reader.connections}
        assert {
            name: qos.durability.name
            for name, qos in offered.items()
            if qos.durability.name != "VOLATILE"
        } == {"/rig/stopped": "TRANSIENT_LOCAL"}


def test_times_are_those_of_sending_and_receiving(ros: Graph, tmp_path: Path) -> None:
    user = ros.user()
    commands = user.create_publisher(Float64, "/rig/pwm", 10)
    node = recorder(ros, tmp_path / "run", topics=["/rig/pwm"])
    connect(ros, commands)
    before = user.get_clock().now().nanoseconds
    for k in range(10):
        commands.publish(Float64(data=float(k)))
    finish(ros, node, **{"rig/pwm": 10})
    after = user.get_clock().now().nanoseconds
    with data_file(tmp_path / "run").open("rb") as stream:
        from mcap.reader import make_reader

        received = [m for _, _, m in make_reader(stream).iter_messages()]
    assert [m.sequence for m in received] == list(range(1, 11))
    assert all(before <= m.publish_time <= m.log_time <= after for m in received)


def test_settings_and_files_are_kept(ros: Graph, tmp_path: Path) -> None:
    (tmp_path / "plan.yaml").write_text("phases: []\n")
    node = recorder(
        ros,
        tmp_path / "run",
        twin=str(CONFIG / "inteco.yaml"),
        plan=str(tmp_path / "plan.yaml"),
        note="dry day",
        seconds=9,
    )
    node.finish()
    kept = index(tmp_path / "run")["custom_data"]
    assert kept["twin"] == (CONFIG / "inteco.yaml").read_text() and kept["plan"] == "phases: []\n"
    assert (
        kept["note"] == "dry day" and kept["twin_file"] == "inteco.yaml" and "driver" not in kept
    )
    settings = json.loads(kept["settings"])
    assert settings["seconds"] == 9.0 and settings["topics"][:2] == [
        "/rig/joint_states",
        "/rig/pwm",
    ]


def test_a_topic_that_appears_later_is_recorded_as_it_is_offered(
    ros: Graph, tmp_path: Path
) -> None:
    node = recorder(ros, tmp_path / "run", topics=["a", "/b"])
    user = ros.user()
    first = user.create_publisher(Float64, "/a", 10)
    connect(ros, first)
    first.publish(Float64(data=1.0))
    ros.until(lambda: recorded(node, "/a") == 1, "the first message")
    second = user.create_publisher(Float64, "/b", HURRIED)
    connect(ros, second)
    second.publish(Float64(data=2.0))
    hurried = user.create_publisher(
        Float64, "/a", HURRIED
    )  # a reliable subscription would not hear it
    connect(ros, hurried)
    hurried.publish(Float64(data=3.0))
    connect(ros, first)
    first.publish(Float64(data=4.0))
    finish(ros, node, a=3, b=1)
    assert sorted((m.topic, m.decoded.data) for m in with_rosbags(tmp_path / "run")) == [
        ("/a", 1.0), ("/a", 3.0), ("/a", 4.0), ("/b", 2.0),
    ]  # fmt: skip
    assert sum(json.loads(index(tmp_path / "run")["custom_data"]["dropped"]).values()) == 0


def test_nothing_is_lost_or_doubled_when_a_laxer_publisher_appears(
    ros: Graph, monkeypatch
) -> None:
    """The request is relaxed for it: the subscription before is read until all know the next."""
    monkeypatch.setattr("pendulum_bridge.nodes.raw_topics.TAKEOVER_S", 0.2)
    topics, heard = RawTopics(ros.user("recorder"), ["/pwm"]), []
    (topic,) = topics._heard

    def look() -> None:
        topics.discover()
        heard.extend(message.sequence for message in topics.drain())
        ros.spin()

    def send(count: int) -> None:
        for _ in range(count):
            strict.publish(Float64())
        assert strict.wait_for_all_acked(Duration(seconds=LONGEST_END_S))

    strict = ros.user("strict").create_publisher(Float64, "/pwm", QoSProfile(depth=100))
    until(strict.get_subscription_count, "the first subscription", look)
    send(20)
    until(lambda: len(heard) >= 20, "the first messages", look)
    ros.user("lax").create_publisher(Float64, "/pwm", HURRIED)
    until(lambda: len(topics._node.get_publishers_info_by_topic("/pwm")) == 2, "the second")
    send(20)  # they wait in the queue while the request is relaxed
    look()
    assert topic.replaced
    send(20)
    until(lambda: len(heard) >= 60, "the messages at the change", look)
    until(lambda: not topic.replaced, "the end of the subscription before", look)
    until(lambda: max(heard) > 60, "a later message", lambda: strict.publish(Float64()) or look())
    assert heard[:60] == list(range(1, 61)) and len(set(heard)) == len(heard)


def test_what_it_cannot_keep_up_with_is_counted(ros: Graph, tmp_path: Path) -> None:
    user = ros.user()
    commands = user.create_publisher(Float64, "/rig/pwm", 10)
    node = recorder(ros, tmp_path / "run", topics=["/rig/pwm"])
    connect(ros, commands)
    commands.publish(Float64(data=-1.0))
    ros.until(lambda: recorded(node, "/rig/pwm") == 1, "the first message")
    for k in range(7000):  # while the recorder does nothing: more than the queue holds
        commands.publish(Float64(data=float(k)))
    ros.until(lambda: recorded(node, "/rig/pwm") > 4000, "what was queued")
    commands.publish(Float64(data=math.inf))
    ros.until(lambda: node._topics.dropped["/rig/pwm"] > 0, "the drops")
    ros.until(lambda: with_last(node) == 7002, "the last message")
    node.finish()
    kept = index(tmp_path / "run")
    dropped = json.loads(kept["custom_data"]["dropped"])["/rig/pwm"]
    assert dropped >= 2000 and kept["message_count"] + dropped == 7002


def with_last(node: RecorderNode) -> int:
    """Return how many messages of the one topic are accounted for."""
    return node._session._bag.tally.total + sum(node._topics.dropped.values())


def test_simulated_time_stamps_messages_by_the_clock(ros: Graph, tmp_path: Path) -> None:
    user = ros.user()
    clock = user.create_publisher(Clock, "/clock", 10)
    commands = user.create_publisher(Float64, "/rig/pwm", 10)
    node = recorder(ros, tmp_path / "run", topics=["/rig/pwm"], use_sim_time=True)
    connect(ros, commands)
    connect(ros, clock, readers=2)  # the recorder's node listens too
    for k in range(50):
        tick = Clock()
        tick.clock.sec, tick.clock.nanosec = 7, k * 1_000_000
        clock.publish(tick)
        commands.publish(Float64(data=float(k)))
    finish(ros, node, **{"rig/pwm": 50})
    received = with_rosbags(tmp_path / "run")
    assert [m.received_ns for m in received] == [7 * 10**9 + k * 1_000_000 for k in range(50)]
    assert [m.decoded.data for m in received] == list(range(50))


def test_a_type_that_is_not_installed_is_left_out_with_a_word(
    ros: Graph, tmp_path: Path, monkeypatch, capfd
) -> None:
    from pendulum_bridge.nodes import raw_topics

    def missing(type_name: str) -> type:
        raise ModuleNotFoundError("No module named 'strange_msgs'")

    monkeypatch.setattr(raw_topics, "_import_message_class", missing)
    ros.user().create_publisher(Float64, "/a", 10)
    node = recorder(ros, tmp_path / "run", topics=["/a"])
    ros.until(lambda: node._topics._heard[0].useless, "a look at the topic")
    node.finish()
    assert "/a is not recorded" in capfd.readouterr().err
    assert index(tmp_path / "run")["message_count"] == 0


def test_a_failure_closes_the_bag_and_says_why(ros: Graph, tmp_path: Path, monkeypatch) -> None:
    commands = ros.user().create_publisher(Float64, "/a", 10)
    node = recorder(ros, tmp_path / "run", topics=["/a"])
    connect(ros, commands)
    commands.publish(Float64(data=1.0))
    ros.until(lambda: recorded(node, "/a") == 1, "the message")
    monkeypatch.setattr(node._topics, "drain", lambda: 1 / 0)
    ros.until(lambda: node.ended, "the end")
    with pytest.raises(BadInputError, match="the recording ended: ZeroDivisionError"):
        node.finish()
    assert [m.decoded.data for m in with_rosbags(tmp_path / "run")] == [1.0]


def test_health_is_published_once_a_second(ros: Graph, tmp_path: Path) -> None:
    user, heard = ros.user(), []
    user.create_subscription(DiagnosticArray, "/diagnostics", heard.append, 10)
    commands = user.create_publisher(Float64, "/rig/pwm", 10)
    recorder(ros, tmp_path / "run", topics=["/rig/pwm", "/nobody"])
    connect(ros, commands)
    ros.until(
        lambda: (commands.publish(Float64()), heard and heard[-1].status[0].level == b"\0")[-1],
        "health that is OK",
    )
    status = heard[-1].status[0]
    figures = {pair.key: pair.value for pair in status.values}
    assert (
        status.name == "/recorder" and int(figures["messages"]) > 0 and int(figures["bytes"]) > 0
    )
    assert (
        figures["dropped"] == "0"
        and figures["waiting_for"] == "/nobody"
        and float(figures["rate_hz"]) > 0
    )


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"out": ""}, "out: expected the folder to write, found none"),
        ({"topics": [1, 2]}, "topics: expected a list of texts"),
        ({"topics": ["/a b"]}, "topics: expected names of topics, found '/a b'"),
        ({"compression": "lz4"}, "compression: expected one of none, zstd, found 'lz4'"),
        ({"seconds": -1.0}, "seconds: expected a number from 0 to 1e\\+06, found -1"),
        ({"twin": "/no/such.yaml"}, "twin: expected a file to keep, found /no/such.yaml"),
        ({"least_free_mb": 1e9}, "expected at least 1e\\+09 MB free"),
    ],
)
def test_wrong_parameters_are_refused_and_nothing_is_made(
    ros: Graph, tmp_path: Path, values: dict, sentence: str
) -> None:
    with pytest.raises(BadInputError, match=sentence):
        ros.add(RecorderNode, **{"out": str(tmp_path / "run"), **values})
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("arguments", "status", "sentence"),
    [
        (
            ["--ros-args", "-p", "out:={tmp}/file/run"],
            1,
            "expected a place to write to, found Not a directory",
        ),
        (
            ["--recover", "{tmp}/nothing"],
            1,
            "expected a rosbag2 folder or an .mcap file with data, found none",
        ),
        (["--recover"], 2, "expected one argument"),
        (["--faster"], 2, "unrecognized arguments: --faster"),
    ],
)
def test_what_cannot_run_ends_with_a_sentence(
    ros: Graph, tmp_path: Path, arguments, status: int, sentence: str
) -> None:
    (tmp_path / "file").write_text("")
    program = ros.start(MODULE, *[word.replace("{tmp}", str(tmp_path)) for word in arguments])
    _, said = program.communicate(timeout=LONGEST_END_S)
    assert program.returncode == status and sentence in said and "Traceback" not in said


def test_two_recorders_on_one_folder_and_a_signal_that_ends_one(
    ros: Graph, tmp_path: Path
) -> None:
    commands = ros.user().create_publisher(Float64, "/rig/pwm", 10)
    arguments = ("--ros-args", "-p", f"out:={tmp_path / 'run'}", "-p", "topics:=[/rig/pwm]")
    first = ros.start(MODULE, *arguments)
    connect(ros, commands)
    second = ros.start(MODULE, *arguments)
    commands.publish(Float64(data=1.0))
    _, said = second.communicate(timeout=LONGEST_END_S)
    assert (
        second.returncode == 1
        and "recordings are not overwritten" in said
        and "Traceback" not in said
    )
    commands.publish(Float64(data=2.0))
    ros.until(lambda: data_file(tmp_path / "run").stat().st_size > 1000, "the messages")
    commands.publish(Float64(data=3.0))  # not yet flushed when the signal comes
    first.send_signal(signal.SIGTERM)
    _, said = first.communicate(timeout=LONGEST_END_S)
    assert first.returncode == 0 and "recorded" in said and "3 messages, none dropped" in said
    assert [m.decoded.data for m in with_rosbags(tmp_path / "run")] == [1.0, 2.0, 3.0]


def test_it_ends_by_itself_after_its_seconds(ros: Graph, tmp_path: Path) -> None:
    commands = ros.user().create_publisher(Float64, "/rig/pwm", 10)
    program = ros.start(
        MODULE,
        "--ros-args",
        "-p",
        f"out:={tmp_path / 'run'}",
        "-p",
        "seconds:=1",
        "-p",
        "topics:=/rig/pwm",
    )
    ros.until(lambda: (commands.publish(Float64()), program.poll() is not None)[-1], "the end")
    assert program.returncode == 0
    # from the first message to the last: this process may have stood still before the end
    assert float(index(tmp_path / "run")["custom_data"]["seconds"]) > 0.0


def test_a_full_disk_ends_with_a_sentence_and_loses_nothing_written(
    ros: Graph, tmp_path: Path
) -> None:
    user = ros.user()
    states = user.create_publisher(JointState, "/rig/joint_states", 10)
    commands = user.create_publisher(Float64, "/rig/pwm", 10)
    program = ros.start(MODULE, "--ros-args", "-p", f"out:={tmp_path / 'run'}")
    connect(ros, states, commands)
    resource.prlimit(
        program.pid, resource.RLIMIT_FSIZE, (50_000, 50_000)
    )  # to a writer the same as a full disk
    sent = 0

    def send() -> bool:
        nonlocal sent
        for _ in range(5):
            states.publish(state(sent, random.Random(sent)))
            commands.publish(Float64(data=float(sent)))
            sent += 1
        return program.poll() is not None

    ros.until(send, "the end")
    said = program.communicate(timeout=LONGEST_END_S)[1]
    assert program.returncode == 1 and "Traceback" not in said
    assert "File too large" in said and "--recover" in said
    raw = read_bag(tmp_path / "run")
    assert raw.lost_messages == 0 and index(tmp_path / "run")["custom_data"]["state"] == "cut"
    assert len(raw.cart) > 50 and np.array_equal(raw.command, np.arange(len(raw.command)))
    assert len(raw.cart) == counts(tmp_path / "run")["/rig/joint_states"]
    recovered = recover(tmp_path / "run").folder
    assert (
        counts(recovered) == counts(tmp_path / "run")
        and len(with_rosbags(recovered)) == index(recovered)["message_count"]
    )


def test_a_stopped_recorder_counts_what_it_missed(ros: Graph, tmp_path: Path) -> None:
    commands = ros.user().create_publisher(Float64, "/rig/pwm", 10)
    program = ros.start(
        MODULE, "--ros-args", "-p", f"out:={tmp_path / 'run'}", "-p", "topics:=[/rig/pwm]"
    )
    connect(ros, commands)
    commands.publish(Float64(data=0.0))
    ros.until(lambda: data_file(tmp_path / "run").stat().st_size > 1000, "the first message")
    program.send_signal(signal.SIGSTOP)
    sent = 20_001
    for k in range(1, sent):
        commands.publish(Float64(data=float(k)))
    program.send_signal(signal.SIGCONT)

    def last() -> bool:
        nonlocal sent
        commands.publish(Float64(data=float(sent)))
        sent += 1
        return struct.pack("<d", sent - 50.0) in data_file(tmp_path / "run").read_bytes()

    ros.until(last, "messages after it went on")
    program.send_signal(signal.SIGINT)
    program.communicate(timeout=LONGEST_END_S)
    kept = [int(m.decoded.data) for m in with_rosbags(tmp_path / "run")]
    missing = kept[-1] + 1 - len(kept)
    assert json.loads(index(tmp_path / "run")["custom_data"]["dropped"])["/rig/pwm"] == missing > 0


def test_a_node_of_another_kind_is_not_disturbed(ros: Graph, tmp_path: Path) -> None:
    """The recorder's subscriptions have no callbacks: other nodes of its process are served."""
    node = recorder(ros, tmp_path / "run", topics=["/a"])
    other, heard = Node("other", context=ros.context), []
    other.create_subscription(Float64, "/a", heard.append, 10)
    ros.serve(other)
    sender = ros.user().create_publisher(Float64, "/a", 10)
    connect(ros, sender, readers=2)
    sender.publish(Float64(data=5.0))
    ros.until(lambda: heard and recorded(node, "/a"), "both")
    node.finish()


@pytest.mark.parametrize(
    ("outcome", "given_up"),
    [
        ("played to its end", ""),
        ("not played to its end: The plan was aborted by request.", "not played to its end: The"),
        ("under way", "under way"),
    ],
)
def test_a_plan_that_was_given_up_is_kept_and_told_by_sysid(
    ros: Graph, tmp_path: Path, capsys, outcome: str, given_up: str
) -> None:
    node, user = recorder(ros, tmp_path / "run"), ros.user()
    states = user.create_publisher(JointState, "/rig/joint_states", 10)
    outcomes = user.create_publisher(String, "/excitation/outcome", LATCHED)
    connect(ros, states, outcomes)
    outcomes.publish(String(data=outcome))
    for k in range(5):
        sample = JointState(name=["pole"], position=[math.pi], velocity=[0.0])
        sample.header.stamp.nanosec = k * 10_000_000
        states.publish(sample)
    ros.until(lambda: recorded(node, "/rig/joint_states") == 5, "the samples")
    ros.until(lambda: node._session._bag.custom.get("plan_outcome") == outcome, "the outcome")
    ros.remove(node)
    assert read_bag(tmp_path / "run").given_up.startswith(given_up)
    assert bool(read_bag(tmp_path / "run").given_up) == bool(given_up)
    sysid(["replay", str(tmp_path / "run"), "--twin", str(CONFIG / "inteco.yaml")])
    said = capsys.readouterr().err.splitlines()[0]
    assert ("is of an experiment that did not end" in said) == bool(given_up)
