"""Write samples and commands of a run as a rosbag2 folder (mcap, ros2msg)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.arrays import Floats
from pendulum_twin.bags.write import Commands, States, write_recording
from pendulum_twin.errors import BadInputError

STATE_TOPIC, COMMAND_TOPIC = "/rig/joint_states", "/rig/pwm"


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
    states = States(state_topic, log.stamps_ns, log.joints, log.positions, log.velocities)
    sent = None if log.commands is None else Commands(command_topic, log.stamps_ns, log.commands)
    write_recording(path, states, sent)
