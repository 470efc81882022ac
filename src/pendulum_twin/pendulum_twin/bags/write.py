"""Write samples and commands as a rosbag2 folder (mcap, ros2msg), whole or not at all.

Messages stand in the order of their times, so that a damaged or cut bag loses samples and commands
of the same time, and every chunk has a CRC, so that no reader takes a flipped bit for a number.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from heapq import merge
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.typesys import Stores, get_typestore

from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.bags.bag import Bag
from pendulum_twin.bags.records import Message, Topic
from pendulum_twin.errors import BadInputError

STATE_TYPE, COMMAND_TYPE = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"


@dataclass(frozen=True)
class States:
    """Hold samples.

    topic: name.
    stamps_ns: (n,) sampling times, since the epoch; they also stand as receive times.
    joints: names, in the order of the columns.
    positions: (n, joints) m, rad.
    velocities: (n, joints) m/s, rad/s; None without.
    """

    topic: str
    stamps_ns: Ints
    joints: Sequence[str]
    positions: Floats
    velocities: Floats | None = None


@dataclass(frozen=True)
class Commands:
    """Hold commands.

    topic: name.
    times_ns: (m,) receive times, since the epoch.
    values: (m,) PWM fraction.
    """

    topic: str
    times_ns: Ints
    values: Floats


def write_recording(
    folder: Path,
    states: States,
    commands: Commands | None,
    custom: Mapping[str, str] | None = None,
) -> None:
    """Write a new folder; a command stands after a sample of the same time.

    custom: texts for the index's `custom_data`.
    Raises BadInputError when the folder cannot be written, OSError when the disk fails, and
    ValueError for commands without a time each.
    """
    if commands is not None and len(commands.times_ns) != len(commands.values):
        raise ValueError(
            f"expected a time for each command, found {len(commands.times_ns)} for "
            f"{len(commands.values)}"
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder.parent, prefix=f".{folder.name}.") as temporary:
        whole = Path(temporary) / folder.name  # the data file is named after the folder
        started_ns = int(states.stamps_ns[0]) if len(states.stamps_ns) else 0
        bag = Bag(whole, started_ns=started_ns, custom=custom, data_name=f"{folder.name}.mcap")
        bag.add_topic(_describe_topic(states.topic, STATE_TYPE))
        if commands is not None:
            bag.add_topic(_describe_topic(commands.topic, COMMAND_TYPE))
        sent = () if commands is None else _pack_commands(commands)
        for message in merge(_pack_states(states), sent, key=lambda m: m.received_ns):
            bag.keep(message)
        bag.close()
        try:
            whole.rename(folder)
        except OSError as error:
            raise BadInputError(
                f"{folder}: expected no folder there, found {error.strerror}: recordings are not "
                "overwritten"
            ) from error


@cache
def _get_store() -> Any:
    return get_typestore(Stores.ROS2_JAZZY)


def _describe_topic(name: str, kind: str) -> Topic:
    store = _get_store()
    definition, _ = store.generate_msgdef(kind, ros_version=2)
    return Topic(name, kind, definition, store.hash_rihs01(kind))


def _pack_states(states: States) -> Iterator[Message]:
    store = _get_store()
    header, time, state = (
        store.types[name]
        for name in ("std_msgs/msg/Header", "builtin_interfaces/msg/Time", STATE_TYPE)
    )
    names, nothing = list(states.joints), np.empty(0)
    positions = np.ascontiguousarray(states.positions, dtype=np.float64)
    rates = None
    if states.velocities is not None:
        rates = np.ascontiguousarray(states.velocities, dtype=np.float64)
    for row in np.argsort(states.stamps_ns, kind="stable").tolist():
        stamp = int(states.stamps_ns[row])
        when = header(time(*divmod(stamp, 10**9)), "")
        rate = nothing if rates is None else rates[row]
        sample = state(when, names, positions[row], rate, nothing)
        data = bytes(store.serialize_cdr(sample, STATE_TYPE))
        yield Message(states.topic, stamp, stamp, 0, data)


def _pack_commands(commands: Commands) -> Iterator[Message]:
    store = _get_store()
    float64 = store.types[COMMAND_TYPE]
    for row in np.argsort(commands.times_ns, kind="stable").tolist():
        time = int(commands.times_ns[row])
        data = bytes(store.serialize_cdr(float64(float(commands.values[row])), COMMAND_TYPE))
        yield Message(commands.topic, time, time, 0, data)
