"""Publish what a live twin gives out."""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from pendulum_twin import topics
from pendulum_twin.arrays import Floats
from pendulum_twin.nodes.messages import list_joints, to_float
from pendulum_twin.nodes.qos import LATCHED, SAMPLES
from pendulum_twin.nodes.sim_clock import SimClock
from pendulum_twin.rig import Rig
from pendulum_twin.topics import JOINTS


class TwinOutlet:
    """Publish samples of the joints of a rig, and move the simulated clock, if any, with them.

    The same message is filled anew each time: making a sample costs as much as publishing it.

    to_stamp: returns the stamp of a time, both ns.
    """

    def __init__(
        self,
        node: Node,
        rig: Rig,
        clock: SimClock | None,
        to_stamp: Callable[[int], int] = int,
    ) -> None:
        self._to_stamp = to_stamp
        # before the samples: who knows of them knows that a limit will come
        self._limit = node.create_publisher(Float64, topics.PWM_LIMIT, LATCHED)
        self._states = node.create_publisher(JointState, topics.JOINT_STATES, SAMPLES)
        self._applied = node.create_publisher(Float64, topics.APPLIED_PWM, SAMPLES)
        self._pwm = Float64()
        self._clock = clock
        self.show(rig)

    def show(self, rig: Rig) -> None:
        """Publish the joints of this rig from now on, and its limit once."""
        self._limit.publish(to_float(rig.pwm_limit or math.inf))
        self._sample = JointState(name=list_joints(rig))
        self._positions = [JOINTS.index(name) for name in list_joints(rig)]
        self._velocities = [len(JOINTS) + k for k in self._positions]

    def publish_sample(self, state: Floats, stamp_ns: int) -> None:
        """Publish a measured state."""
        message, values = self._sample, state.tolist()
        stamp = message.header.stamp
        stamp.sec, stamp.nanosec = divmod(self._to_stamp(stamp_ns), 10**9)
        message.position = array("d", [values[k] for k in self._positions])
        message.velocity = array("d", [values[k] for k in self._velocities])
        self._states.publish(message)
        if self._clock is not None:
            self._clock.move(stamp_ns)

    def publish_applied(self, pwm: float) -> None:
        """Publish the PWM fraction that is held."""
        self._pwm.data = pwm
        self._applied.publish(self._pwm)
