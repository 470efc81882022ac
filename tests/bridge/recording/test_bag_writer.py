"""A recording is a rosbag2 folder that others read, whole or not there."""

import numpy as np
import pytest
from rosbags.highlevel import AnyReader

from pendulum_bridge.recording.bag_writer import Log, write_bag
from pendulum_twin.errors import BadInputError


def some_log(count: int = 50, commands: bool = True) -> Log:
    random = np.random.default_rng(0)
    stamps = 1_700_000_000_999_000_000 + np.arange(count) * 10_000_000
    sent = random.uniform(-0.5, 0.5, count) if commands else None
    return Log(
        stamps,
        ("cart", "pole"),
        random.normal(size=(count, 2)),
        random.normal(size=(count, 2)),
        sent,
    )


def read(path):
    states, commands = [], []
    with AnyReader([path]) as reader:
        schemas = {c.topic: c.msgdef.format.name for c in reader.connections}
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            (states if connection.topic == "/rig/joint_states" else commands).append(
                (stamp, message)
            )
    return states, commands, schemas


def test_a_written_bag_reads_back(tmp_path) -> None:
    log = some_log()
    write_bag(log, tmp_path / "recording")
    states, commands, schemas = read(tmp_path / "recording")
    assert set(schemas.values()) == {"MSG"}
    assert list(log.stamps_ns) == [
        m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for _, m in states
    ]
    assert (
        list(log.stamps_ns) == [stamp for stamp, _ in states] == [stamp for stamp, _ in commands]
    )
    assert all(m.name == ["cart", "pole"] for _, m in states)
    assert np.array_equal([m.position for _, m in states], log.positions)
    assert np.array_equal([m.velocity for _, m in states], log.velocities)
    assert np.array_equal([m.data for _, m in commands], log.commands)


def test_a_pole_alone_needs_no_commands(tmp_path) -> None:
    count = 10
    log = Log(np.arange(count) * 10**7, ("pole",), np.ones((count, 1)), np.zeros((count, 1)), None)
    write_bag(log, tmp_path / "swing")
    states, commands, _ = read(tmp_path / "swing")
    assert len(states) == count and commands == [] and states[0][1].name == ["pole"]


def test_a_recording_is_never_overwritten(tmp_path) -> None:
    write_bag(some_log(), tmp_path / "recording")
    before = (tmp_path / "recording" / "recording.mcap").read_bytes()
    with pytest.raises(BadInputError, match="recordings are not overwritten"):
        write_bag(some_log(20), tmp_path / "recording")
    assert (tmp_path / "recording" / "recording.mcap").read_bytes() == before


def test_a_failure_leaves_nothing(tmp_path) -> None:
    log = some_log()
    broken = Log(
        log.stamps_ns, log.joints, log.positions, log.velocities, log.commands.astype(object)
    )
    broken.commands[30] = None
    with pytest.raises(TypeError):
        write_bag(broken, tmp_path / "late")
    assert list(tmp_path.iterdir()) == []


def test_columns_of_unequal_length_are_refused() -> None:
    with pytest.raises(BadInputError, match="expected 5 commands"):
        Log(np.arange(5), ("cart",), np.zeros((5, 1)), np.zeros((5, 1)), np.zeros(4))
    with pytest.raises(BadInputError, match="expected positions and velocities"):
        Log(np.arange(5), ("cart", "pole"), np.zeros((5, 1)), np.zeros((5, 1)), None)
