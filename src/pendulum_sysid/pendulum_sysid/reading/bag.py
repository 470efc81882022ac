"""Read a rosbag2 recording into arrays, and write one. The only module that knows rosbags."""

from __future__ import annotations

import tempfile
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from pendulum_sysid import decisions
from pendulum_sysid.errors import FileError, UnusableRecording
from pendulum_sysid.reading import mcap_stream
from pendulum_sysid.reading.bag_files import BagFiles, find_files, find_plan_outcome
from pendulum_sysid.reading.command_latency import read_command_latency
from pendulum_sysid.reading.contents import Contents
from pendulum_sysid.reading.decoding import decode_commands, decode_states, list_joint_names
from pendulum_sysid.reading.raw import JOINTS, STATE_CHANNELS, RawRecording
from pendulum_sysid.reading.sent_commands import (
    SentCommands,
    find_differences,
    name_sent_topic,
)
from pendulum_sysid.reading.unpacking import unpack_file, unpack_message
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.bags.write import Commands, States, write_recording
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest
from pendulum_twin.topics import PLAYED

STATE_TOPIC, STATE_TYPE = "/rig/joint_states", "sensor_msgs/msg/JointState"
COMMAND_TOPIC, COMMAND_TYPE = "/rig/pwm", "std_msgs/msg/Float64"

# What the two types are made of, as ROS 2 defines it: to load all types of a distribution takes
# more than ten times as long.
DEFINITIONS = {
    "builtin_interfaces/msg/Time": "int32 sec\nuint32 nanosec",
    "std_msgs/msg/Header": "builtin_interfaces/Time stamp\nstring frame_id",
    STATE_TYPE: "std_msgs/Header header\nstring[] name\n"
    "float64[] position\nfloat64[] velocity\nfloat64[] effort",
    COMMAND_TYPE: "float64 data",
}


def _make_store() -> Typestore:
    store = get_typestore(Stores.EMPTY)
    for name, definition in DEFINITIONS.items():
        store.register(get_types_from_msg(definition, name))
    return store


_STORE = _make_store()


def read_bag(
    path: str | Path, state_topic: str = STATE_TOPIC, command_topic: str = COMMAND_TOPIC
) -> RawRecording:
    """Return what a bag holds, as recorded.

    path: a rosbag2 folder (mcap or sqlite3, with or without its index) or one data file. A
    sample's time is its header's stamp, a command's the time it was received. A file that was cut
    is read as far as it goes; what is known to be missing is in `lost_messages` and `cut_short`. A
    recording of a pole alone may have no commands. Raises FileError, WrongUse or
    UnusableRecording, one sentence after the path, when there is no bag or it cannot be used.
    """
    path = Path(path)
    try:
        bag = find_files(path)
        topics = state_topic, command_topic, name_sent_topic(command_topic)
        contents = _read_contents(bag, topics)
        return _make_recording(_make_name(path), bag, contents, state_topic, command_topic)
    except BadInputError as error:
        raise type(error)(f"{path}: {error}") from error
    except OSError as error:
        raise FileError(
            f"{path}: expected a readable recording, found {error.strerror}: check its rights"
        ) from error


def _make_name(path: Path) -> str:
    return path.resolve().name.removesuffix(".zstd").removesuffix(".mcap").removesuffix(".db3")


def _read_contents(bag: BagFiles, wanted: Collection[str]) -> Contents:
    contents = Contents(wanted)
    with tempfile.TemporaryDirectory() as folder:
        for file in bag.files:
            if file.stat().st_size:
                data = unpack_file(file, Path(folder))
                contents.absorb(
                    _scan_sqlite(data, wanted)
                    if data.suffix == ".db3"
                    else mcap_stream.scan_mcap(data, wanted)
                )
            else:
                contents.whole = False
    if bag.packed_messages:
        for messages in contents.messages.values():
            messages[:] = [(time, unpack_message(data)) for time, data in messages]
    for messages in contents.messages.values():
        messages.sort(key=lambda message: message[0])
    if not contents.types and not contents.whole:
        raise FileError(
            "expected a recording, found a file cut before its first message: record again"
        )
    return contents


def _scan_sqlite(path: Path, wanted: Collection[str]) -> Contents:
    contents = Contents(wanted)
    try:
        with Reader(path) as reader:
            contents.types = {c.topic: c.msgtype for c in reader.connections}
            contents.counted = {c.topic: c.msgcount for c in reader.connections}
            chosen = [c for c in reader.connections if c.topic in wanted]
            for connection, time_ns, data in reader.messages(connections=chosen) if chosen else ():
                contents.add(connection.topic, time_ns, data)
    except Exception as error:  # the database engine's own errors, which rosbags does not wrap
        if not contents.messages:
            raise FileError(
                f"expected an sqlite3 recording, found {path.name} cut or damaged ({error}): "
                "rescue it with `sqlite3 .recover`"
            ) from error
        contents.whole = False
    return contents


def _decode_state(data: bytes) -> Any:
    return _STORE.deserialize_cdr(data, STATE_TYPE)


def _decode_command(data: bytes) -> Any:
    return _STORE.deserialize_cdr(data, COMMAND_TYPE)


def _make_recording(
    name: str, bag: BagFiles, contents: Contents, state_topic: str, command_topic: str
) -> RawRecording:
    states = contents.of(state_topic, STATE_TYPE, "--state-topic", needed=True)
    decoded = decode_states(states, _decode_state)
    stamps = decoded.stamps_ns
    as_stamped = np.array_equal(decoded.received_ns, stamps)  # a converted file: no arrivals
    if not any(joint in decoded.channels for joint in JOINTS):
        raise UnusableRecording(
            f"expected positions of joints named cart or pole on {state_topic}, found "
            f"{list_joint_names(states, _decode_state)}: name the joints so, and give each a "
            "position"
        )
    commands = _pick_commands(contents, command_topic, needed="cart" in decoded.channels)
    command_times, command, bad_commands = decode_commands(commands, _decode_command)
    _check_same_clock(stamps, command_times, state_topic, command_topic)
    counted = bag.counted or contents.counted
    short = (
        sum(counted.get(topic, 0) for topic in (state_topic, command_topic))
        - len(states)
        - len(commands)
    )
    state_stamp_s = (stamps - stamps[0]) / 1e9
    command_stamp_s = (command_times - stamps[0]) / 1e9
    return RawRecording(
        name=name,
        digest=compute_digest(bag.files),
        state_stamp_s=state_stamp_s,
        command_stamp_s=command_stamp_s,
        command=command,
        **{channel: decoded.channels.get(channel) for channel in STATE_CHANNELS},
        state_received_s=None if as_stamped else (decoded.received_ns - stamps[0]) / 1e9,
        lost_messages=max(0, short) + decoded.unused + bad_commands,
        cut_short=not contents.whole and not (counted and short == 0),
        given_up="" if find_plan_outcome(bag) == PLAYED else find_plan_outcome(bag),
        damaged_parts=contents.damaged_parts,
        command_latency=read_command_latency(bag.custom),
        sent=_compare_sent(
            contents, command_topic, stamps[0], state_stamp_s, (command_stamp_s, command)
        ),
    )


def _compare_sent(
    contents: Contents,
    command_topic: str,
    first_ns: int,
    state_stamp_s: Floats,
    read: tuple[Floats, Floats],
) -> SentCommands | None:
    """Return where the driver sent other commands than the commands that were read.

    first_ns: of the first sample.

    None where they are nearly the same, and where the bag does not say.
    """
    topic = name_sent_topic(command_topic)
    messages = contents.messages.get(topic, [])
    if topic == command_topic or contents.types.get(topic) != COMMAND_TYPE:
        return None
    times, sent, _ = decode_commands(messages, _decode_command)
    here = [
        (t[np.isfinite(u)], u[np.isfinite(u)]) for t, u in (read, ((times - first_ns) / 1e9, sent))
    ]
    if len(state_stamp_s) < 2 or not all(len(t) for t, _ in here):
        return None
    differ = find_differences(state_stamp_s, *here)
    rare = np.mean(differ) <= decisions.COMMAND_MOST_DIFFER
    return None if rare else SentCommands(command_topic, topic, differ)


def _pick_commands(contents: Contents, topic: str, needed: bool) -> list[tuple[int, bytes]]:
    """Return the commands; a recording without a cart needs none."""
    if topic not in contents.types and not needed:
        return []
    return contents.of(topic, COMMAND_TYPE, "--command-topic", needed)


def _check_same_clock(
    stamps: Ints, command_times: Ints, state_topic: str, command_topic: str
) -> None:
    if not len(command_times):
        return
    late = (command_times[0] - stamps[-1]) * 1e-9
    early = (stamps[0] - command_times[-1]) * 1e-9
    if late > 0 or early > decisions.COMMAND_HOLDS_S:
        apart = (
            f"{late:.6g} s after the last stamp"
            if late > 0
            else f"{early:.6g} s before the first stamp"
        )
        raise UnusableRecording(
            f"expected commands on {command_topic} received while {state_topic} was sampled, "
            f"found them all {apart}: "
            "stamp and record with one clock (use_sim_time the same everywhere)"
        )


def write_bag(
    path: str | Path,
    stamps_ns: Ints,
    joints: Mapping[str, Floats],
    command: Floats | None = None,
    *,
    velocities: Mapping[str, Floats] | None = None,
    command_times_ns: Ints | None = None,
    state_topic: str = STATE_TOPIC,
    command_topic: str = COMMAND_TOPIC,
) -> None:
    """Write samples and commands as a rosbag2 folder (mcap, index version 9), whole or not at all.

    stamps_ns: (n,) sampling times, also the receive times, 0 or later. joints: joint name -> (n,)
    positions, in the order of the names in the messages. command: (m,) values received at
    command_times_ns, by default at the stamps; None writes no command topic. velocities: joint
    name -> (n,), for all joints or none. Raises FileError when the path exists or cannot be
    written.
    """
    path = Path(path)
    if path.exists():
        raise FileError(
            f"{path}: expected a new folder to write, found it there already: name another or "
            "remove it"
        )
    names = list(joints)
    rates = np.column_stack([velocities[name] for name in names]) if velocities else None
    positions = np.column_stack([joints[name] for name in names])
    times = stamps_ns if command_times_ns is None else command_times_ns
    sent = None if command is None else Commands(command_topic, times, command)
    try:
        write_recording(path, States(state_topic, stamps_ns, names, positions, rates), sent)
    except (BadInputError, OSError) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise FileError(
            f"{path}: expected a place to write to, found {reason}: name another"
        ) from error
