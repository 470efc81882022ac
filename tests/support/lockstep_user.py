"""A user of the twin in lockstep, as its docstring says that one begins and goes on."""

import numpy as np
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_twin.nodes.direct import DirectSubscription
from pendulum_twin.nodes.messages import from_joint_state, from_time
from pendulum_twin.nodes.qos import LATEST, SAMPLES
from pendulum_twin.reset_answer import parse_stamp
from support.ros_graph import Graph, until

ANSWER_S = 20.0


class LockstepUser:
    """Reset, then exchange a command for a sample: its stamp (ns) and the state (4,)."""

    def __init__(self, ros: Graph, name: str = "user") -> None:
        self.ros = ros
        self.node: Node = ros.user(name)
        self.sender = self.node.create_publisher(Float64, "pwm", LATEST)
        self.samples = DirectSubscription(self.node, JointState, "joint_states", SAMPLES)
        self.applied = DirectSubscription(self.node, Float64, "applied_pwm", SAMPLES)
        self.resetter = self.node.create_client(Trigger, "reset")
        self.setter = self.node.create_client(SetParameters, "twin/set_parameters")

    def begin(self) -> tuple[int, np.ndarray]:
        """Return the start state's sample, as soon as the graph is complete."""
        until(self.known, "discovery", self.ros.spin)
        return until(lambda: self.reset(0.5), "the sample of a reset", lambda: None)

    def known(self) -> bool:
        return bool(
            self.sender.get_subscription_count()
            and self.samples.publishers
            and self.applied.publishers
        )

    def reset(self, deadline_s: float = ANSWER_S) -> tuple[int, np.ndarray] | None:
        """Return the sample whose stamp the reset tells; None when it does not come."""
        answer = self.ros.call(self.resetter)
        stamp_ns = parse_stamp(answer.message)
        assert answer.success and stamp_ns is not None
        while (sample := self.sample(deadline_s)) is not None and sample[0] < stamp_ns:
            pass
        assert sample is None or sample[0] == stamp_ns
        return sample

    def send(self, command: float) -> None:
        self.sender.publish(Float64(data=command))

    def step(self, command: float) -> tuple[int, np.ndarray]:
        self.send(command)
        sample = self.sample(ANSWER_S)
        assert sample is not None, f"no answer to {command}"
        return sample

    def sample(self, deadline_s: float) -> tuple[int, np.ndarray] | None:
        message = self.samples.wait(deadline_s)
        return (
            None
            if message is None
            else (from_time(message.header.stamp), from_joint_state(message))
        )

    def set_twin(self, path: object):
        request = SetParameters.Request(
            parameters=[Parameter("twin", value=str(path)).to_parameter_msg()]
        )
        return self.ros.call(self.setter, request).results[0]
