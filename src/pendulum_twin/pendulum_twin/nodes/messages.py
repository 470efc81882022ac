"""Convert numbers to messages and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from builtin_interfaces.msg import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig
from pendulum_twin.topics import CART, JOINTS, POLE


def list_joints(rig: Rig) -> list[str]:
    """Return the names of the joints that a rig has, cart first."""
    return [name for name, there in ((CART, rig.has_cart), (POLE, rig.has_pole)) if there]


def to_time(stamp_ns: int) -> Time:
    """Return nanoseconds as a stamp."""
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return Time(sec=seconds, nanosec=nanoseconds)


def from_time(stamp: Time) -> int:
    """Return a stamp in nanoseconds."""
    return int(stamp.sec) * 10**9 + int(stamp.nanosec)


def to_joint_state(joints: Sequence[str], state: Floats, stamp_ns: int) -> JointState:
    """Return a state as a message of these joints.

    state: (4,) x (m), th (rad), v (m/s), w (rad/s).
    stamp_ns: sampling time, ns.
    """
    columns = [JOINTS.index(name) for name in joints]
    message = JointState(name=list(joints))
    message.header.stamp = to_time(stamp_ns)
    message.position = [float(state[k]) for k in columns]
    message.velocity = [float(state[2 + k]) for k in columns]
    return message


def from_joint_state(message: JointState) -> Floats:
    """Return x (m), th (rad), v (m/s), w (rad/s) of a message, (4,); 0 for a joint it lacks.

    Raises BadInputError when it names neither cart nor pole, or lacks a finite position or
    velocity of a joint that it names.
    """
    state = np.zeros(4)
    places = [
        (k, message.name.index(name)) for k, name in enumerate(JOINTS) if name in message.name
    ]
    if not places:
        raise BadInputError(
            f"joint_states: expected joints named cart or pole, found {list(message.name)}"
        )
    if max(at for _, at in places) >= min(len(message.position), len(message.velocity)):
        raise BadInputError(
            f"joint_states: expected a position and a velocity for each of {list(message.name)}, "
            f"found {len(message.position)} and {len(message.velocity)}"
        )
    for k, at in places:
        state[k], state[2 + k] = message.position[at], message.velocity[at]
    if not np.all(np.isfinite(state)):
        raise BadInputError(f"joint_states: expected finite numbers, found {state.tolist()}")
    return state


def to_float(value: float) -> Float64:
    """Return a number as a message."""
    return Float64(data=float(value))
