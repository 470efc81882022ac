"""What the environment over topics is tested on beside a twin: a rig that does what the test wants."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_twin.nodes.messages import to_joint_state
from pendulum_twin.nodes.qos import LATEST, SAMPLES
from support.ros_graph import until

HANGING = np.array([0.0, np.pi, 0.0, 0.0])


class MadeRig:
    """A rig that samples at 100 Hz while it is alive; its cart's velocity shows the last command that it has heard."""

    def __init__(self, context: Context) -> None:
        self.node = Node("made_rig", namespace="rig", context=context)
        self.samples = self.node.create_publisher(JointState, "joint_states", SAMPLES)
        self.node.create_subscription(
            Float64, "pwm", lambda message: self.commands.append(message.data), LATEST
        )
        self.node.create_service(Trigger, "reset", self.on_reset)
        self.node.create_timer(0.01, self.sample)
        self.commands: list[float] = []
        self.alive, self.refusal, self.joints = True, "", ["cart", "pole"]

    def sample(self) -> None:
        if self.alive:
            state = np.array([*HANGING[:2], self.commands[-1] if self.commands else 0.0, 0.0])
            self.samples.publish(
                to_joint_state(self.joints, state, self.node.get_clock().now().nanoseconds)
            )

    def on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = (
            not self.refusal,
            self.refusal or "The pendulum hangs.",
        )
        return response

    def hears(self, command: float) -> None:
        """Return when this is the last command heard; fail at the deadline."""
        wait = threading.Event().wait
        until(
            lambda: self.commands[-1:] == [command], f"the command {command}", lambda: wait(0.01)
        )


@contextmanager
def made_rig(context: Context) -> Iterator[MadeRig]:
    """Serve such a rig in a thread of its own."""
    rig, executor, stopped = (
        MadeRig(context),
        SingleThreadedExecutor(context=context),
        threading.Event(),
    )
    executor.add_node(rig.node)
    thread = threading.Thread(
        target=lambda: [executor.spin_once(timeout_sec=0.05) for _ in iter(stopped.is_set, True)]
    )
    thread.start()
    try:
        yield rig
    finally:
        stopped.set()
        thread.join()
        executor.shutdown()
        rig.node.destroy_node()
