"""A rig over topics that does what the test wants."""

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
from support.polling import until

HANGING = np.array([0.0, np.pi, 0.0, 0.0])


class MadeRig:
    """A rig that samples at 100 Hz while it is alive.

    Its cart's velocity shows the last command that it had heard when its sample was stamped.
    commands: all that it has heard.
    heard_ns: when it heard the last of them, on the clock of stamps.
    """

    def __init__(self, context: Context) -> None:
        self.node = Node("made_rig", namespace="rig", context=context)
        self.samples = self.node.create_publisher(JointState, "joint_states", SAMPLES)
        self.node.create_subscription(
            Float64, "pwm", lambda message: self.hear(message.data), LATEST
        )
        self.node.create_service(Trigger, "reset", self.on_reset)
        self.node.create_timer(0.01, self.sample)
        self.commands: list[float] = []
        self.heard_ns = 0
        self.alive, self.refusal, self.joints = True, "", ["cart", "pole"]

    def now_ns(self) -> int:
        return self.node.get_clock().now().nanoseconds

    def hear(self, command: float) -> None:
        if self.commands[-1:] != [command]:
            self.heard_ns = self.now_ns()
        self.commands.append(command)

    def sample(self) -> None:
        if self.alive:
            stamp_ns = self.now_ns()
            state = np.array([*HANGING[:2], self.commands[-1] if self.commands else 0.0, 0.0])
            self.samples.publish(to_joint_state(self.joints, state, stamp_ns))

    def on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        response.success, response.message = (
            not self.refusal,
            self.refusal or "The pendulum hangs.",
        )
        return response

    def wait_to_hear(self, command: float) -> None:
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
