"""Publish what the driver gives out."""

from __future__ import annotations

import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64

from pendulum_bridge.safety.rig_state import RigState
from pendulum_twin import topics
from pendulum_twin.nodes.messages import list_joints, to_float, to_joint_state
from pendulum_twin.nodes.qos import LATCHED, SAMPLES
from pendulum_twin.rig import Rig


class DriverOutlet:
    """Publish the driver's output."""

    def __init__(self, node: Node) -> None:
        # before the samples: who knows of them knows that a limit will come
        self._limit = node.create_publisher(Float64, topics.PWM_LIMIT, LATCHED)
        self._states = node.create_publisher(JointState, topics.JOINT_STATES, SAMPLES)
        self._applied = node.create_publisher(Float64, topics.APPLIED_PWM, SAMPLES)
        self._stopped = node.create_publisher(Bool, topics.STOPPED, LATCHED)
        self._joints: list[str] = []
        self._logger = node.get_logger()
        self.publish_stopped(False)

    def show(self, rig: Rig) -> None:
        """Publish the joints of this rig from now on."""
        self._joints = list_joints(rig)

    def publish_sample(self, state: RigState, stamp_ns: int) -> None:
        """Publish a sample."""
        row = np.array([state.cart_m, state.pole_rad, state.cart_m_s, state.pole_rad_s])
        self._states.publish(to_joint_state(self._joints, row, stamp_ns))

    def publish_applied(self, pwm: float) -> None:
        """Publish the command that was sent."""
        self._applied.publish(to_float(pwm))

    def publish_limit(self, limit: float) -> None:
        """Publish the largest command (PWM fraction) that is sent from now on."""
        self._limit.publish(to_float(limit))

    def publish_stopped(self, latched: bool) -> None:
        """Publish whether the emergency stop is latched."""
        self._stopped.publish(Bool(data=latched))

    def report_failure(self, error: Exception) -> None:
        """Log an error of the thread that serves the rig."""
        self._logger.error(
            f"serving the rig failed, PWM is 0: {error!r}", throttle_duration_sec=1.0
        )
