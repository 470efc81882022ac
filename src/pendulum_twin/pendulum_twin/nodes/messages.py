"""Messages from numbers and back: conversions, no decisions."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from pendulum_twin.rig import Rig
from pendulum_twin.signals import Floats
from pendulum_twin.topics import CART, POLE


def joints_of(rig: Rig) -> list[str]:
    """Return the names of the joints that a rig has, in the order of the contract."""
    return [name for name, there in ((CART, rig.has_cart), (POLE, rig.has_pole)) if there]


def to_time(stamp_ns: int) -> Time:
    """Return nanoseconds as a stamp."""
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    return Time(sec=seconds, nanosec=nanoseconds)


def to_joint_state(joints: Sequence[str], state: Floats, stamp_ns: int) -> JointState:
    """Return x (m), th (rad), v (m/s), w (rad/s), sampled at stamp_ns, as a message of the joints there are."""
    columns = [(CART, POLE).index(name) for name in joints]
    message = JointState(name=list(joints))
    message.header.stamp = to_time(stamp_ns)
    message.position = [float(state[k]) for k in columns]
    message.velocity = [float(state[2 + k]) for k in columns]
    return message


def to_float(value: float) -> Float64:
    """Return a number as a message."""
    return Float64(data=float(value))
