"""A pendulum, rig or twin, as a commanding node sees it: a topic for commands and a reset."""

from __future__ import annotations

from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_twin import topics
from pendulum_twin.nodes.messages import to_float
from pendulum_twin.nodes.qos import LATEST

DELIVERY_S = 0.5  # longest wait for the delivery of the last command


class PendulumClient:
    """Command the pendulum of a namespace on behalf of a node.

    namespace: of the pendulum, without a slash at the end.
    """

    def __init__(self, node: Node, namespace: str) -> None:
        self.namespace = namespace
        self._node = node
        self._commands = node.create_publisher(Float64, self.name_topic(topics.PWM), LATEST)
        self._resets = node.create_client(Trigger, self.name_topic(topics.RESET))

    def name_topic(self, name: str) -> str:
        """Return a name in this namespace."""
        return f"{self.namespace}/{name}"

    def send(self, pwm: float) -> None:
        """Send a command (PWM fraction)."""
        self._commands.publish(to_float(pwm))

    def deliver(self) -> None:
        """Wait until the last command has arrived, at most DELIVERY_S."""
        self._commands.wait_for_all_acked(Duration(seconds=DELIVERY_S))

    def reset(self) -> Future:
        """Request a reset and return the future of its answer."""
        return self._resets.call_async(Trigger.Request())

    def find_lacking(self, listeners: int, reset: bool) -> str:
        """Return what is missing before the pendulum can be commanded; empty when all is there.

        listeners: number of nodes that must listen to its commands.
        reset: whether its reset is needed.
        """
        if (heard := self._count_listeners()) < listeners:
            return f"{heard} of {listeners} listen to {self.name_topic(topics.PWM)}"
        others = self._node.count_publishers(self.name_topic(topics.PWM)) - 1
        if others > 0:
            return f"{others} other(s) command {self.name_topic(topics.PWM)}"
        states = self.name_topic(topics.JOINT_STATES)
        if not self._node.count_publishers(states):  # a recorder listens to commands, too
            return (
                f"nobody publishes {states}: start the pendulum's node there, or play the plan "
                "without a twin (-p \"twin:=''\")"
            )
        if reset and not self._resets.service_is_ready():
            return f"nobody offers {self.name_topic(topics.RESET)}"
        return ""

    def _count_listeners(self) -> int:
        """Return how many nodes listen to the commands; a node may do so twice."""
        known = self._node.get_subscriptions_info_by_topic(self.name_topic(topics.PWM))
        nodes = {(endpoint.node_namespace, endpoint.node_name) for endpoint in known}
        # an endpoint that is known may not be connected yet
        return min(len(nodes), self._commands.get_subscription_count())
