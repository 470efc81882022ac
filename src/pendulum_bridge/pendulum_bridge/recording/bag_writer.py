"""Write samples and commands of a run as a rosbag2 folder (mcap, ros2msg)."""

from __future__ import annotations

import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError

STATE_TOPIC, COMMAND_TOPIC = "/rig/joint_states", "/rig/pwm"
STATE_TYPE, COMMAND_TYPE = "sensor_msgs/msg/JointState", "std_msgs/msg/Float64"
VERSION: Literal[9] = 9


@dataclass(frozen=True)
class Log:
    """Hold the samples and commands of a run, a row each sample.

    stamps_ns: (n,) sampling times, since the epoch.
    joints: names, in the order of the columns.
    positions: (n, joints) m, rad.
    velocities: (n, joints) m/s, rad/s.
    commands: (n,) PWM fraction, sent at each sample and held to the next; None without commands.
    Raises BadInputError when the shapes disagree.
    """

    stamps_ns: NDArray[np.int64]
    joints: tuple[str, ...]
    positions: Floats
    velocities: Floats
    commands: Floats | None

    def __post_init__(self) -> None:
        shape = (len(self.stamps_ns), len(self.joints))
        if self.positions.shape != shape or self.velocities.shape != shape:
            raise BadInputError(
                f"expected positions and velocities of shape {shape}, found {self.positions.shape}"
            )
        if self.commands is not None and self.commands.shape != shape[:1]:
            raise BadInputError(f"expected {shape[0]} commands, found {self.commands.shape}")


def write_bag(
    log: Log, path: str | Path, state_topic: str = STATE_TOPIC, command_topic: str = COMMAND_TOPIC
) -> None:
    """Write the folder whole or not at all.

    A command carries the time of its sample, and stands after it.
    Raises BadInputError when the folder exists.
    """
    path = Path(path)
    if path.exists():
        raise BadInputError(
            f"{path}: expected no folder there, found one: recordings are not overwritten"
        )
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=f".{path.name}.") as temporary:
        folder = Path(temporary) / path.name  # the writer names the file after the folder
        _write(log, folder, state_topic, command_topic)
        shutil.move(folder, path)


def _write(log: Log, folder: Path, state_topic: str, command_topic: str) -> None:
    types = get_typestore(Stores.ROS2_JAZZY)
    state, header = types.types[STATE_TYPE], types.types["std_msgs/msg/Header"]
    time, command = types.types["builtin_interfaces/msg/Time"], types.types[COMMAND_TYPE]
    names, no_effort = list(log.joints), np.empty(0)
    with Writer(folder, version=VERSION, storage_plugin=StoragePlugin.MCAP) as writer:
        states = writer.add_connection(state_topic, STATE_TYPE, typestore=types)
        if log.commands is not None:
            commands = writer.add_connection(command_topic, COMMAND_TYPE, typestore=types)
        for k, stamp in enumerate(log.stamps_ns.tolist()):
            when = header(time(*divmod(stamp, 10**9)), "")
            sample = state(
                when, names, log.positions[k].copy(), log.velocities[k].copy(), no_effort
            )
            writer.write(states, stamp, types.serialize_cdr(sample, STATE_TYPE))
            if log.commands is not None:
                sent = command(float(log.commands[k]))
                writer.write(commands, stamp, types.serialize_cdr(sent, COMMAND_TYPE))
