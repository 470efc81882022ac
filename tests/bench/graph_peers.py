"""The peers of the twin's node: the same messages on the same topics, and no twin."""

import sys
from threading import Event

import rclpy
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from pendulum_twin import topics
from pendulum_twin.nodes.direct import DirectSubscription
from pendulum_twin.nodes.messages import to_joint_state
from pendulum_twin.nodes.qos import LATEST, SAMPLES
from pendulum_twin.stepper import HANGING

JOINTS = ["cart", "pole"]
RATE_HZ = 100.0


class Echo:
    """Answer every command with the same sample."""

    def __init__(self, node: Node) -> None:
        self._commands = DirectSubscription(node, Float64, topics.PWM, LATEST)
        self._states = node.create_publisher(JointState, topics.JOINT_STATES, SAMPLES)
        self._sample = to_joint_state(JOINTS, HANGING, 0)

    def answer(self) -> bool:
        message = self._commands.take()
        if message is not None:
            self._states.publish(self._sample)
        return message is not None

    def serve(self, stopped: Event) -> None:
        while not stopped.is_set():
            if self._commands.wait(0.2) is not None:
                self._states.publish(self._sample)


def tick(node: Node, rate_hz: float) -> None:
    """Publish the same sample at a rate, from a timer."""
    states = node.create_publisher(JointState, topics.JOINT_STATES, SAMPLES)
    node.create_timer(
        1 / rate_hz,
        lambda: states.publish(
            to_joint_state(JOINTS, HANGING, node.get_clock().now().nanoseconds)
        ),
    )
    rclpy.spin(node)


if __name__ == "__main__":
    rclpy.init()
    peer = Node(sys.argv[1], namespace="bare")
    if sys.argv[1] == "echo":
        Echo(peer).serve(Event())
    else:
        tick(peer, RATE_HZ)
