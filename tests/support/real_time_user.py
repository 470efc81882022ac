"""A user of the twin in real time."""

import numpy as np
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_twin.nodes.twin_node import TwinNode
from support.paths import CONFIG
from support.ros_graph import Graph

TWIN = CONFIG / "inteco.yaml"


class User:
    """Send commands and keep what comes back."""

    def __init__(self, ros: Graph) -> None:
        node = ros.user()
        self.ros, self.node = ros, node
        self.states: list[JointState] = []
        self.applied: list[float] = []
        node.create_subscription(JointState, "joint_states", self.states.append, 100)
        node.create_subscription(
            Float64, "applied_pwm", lambda m: self.applied.append(m.data), 100
        )
        self.sender = node.create_publisher(Float64, "pwm", 1)
        self.resetter = node.create_client(Trigger, "reset")
        self.until = ros.until

    def more(self, count: int) -> None:
        wanted = len(self.states) + count
        self.until(lambda: len(self.states) >= wanted, f"{count} samples")

    def send(self, value: float) -> None:
        self.sender.publish(Float64(data=value))

    def reset(self) -> Trigger.Response:
        return self.ros.call(self.resetter)


def make_twin(ros: Graph, **values: object) -> TwinNode:
    return ros.add(TwinNode, **{"twin": str(TWIN), **values})


def known_to(twin: TwinNode) -> bool:
    """Tell whether the twin knows its one listener."""
    ours = [p for p in twin.publishers if p.topic_name in ("/joint_states", "/applied_pwm")]
    return all(p.get_subscription_count() == 1 for p in ours)


def arrays(user: User) -> tuple[np.ndarray, np.ndarray]:
    stamps = np.array([m.header.stamp.sec * 10**9 + m.header.stamp.nanosec for m in user.states])
    return stamps, np.array([[*m.position, *m.velocity] for m in user.states])
