"""The live twin: commands in, samples out in real time, by the same names and types as the rig.

At every sampling time the node publishes the sample, decides the command (the last that arrived; clipped, 0 when
stale), publishes it as applied, and holds it to the next sampling time: no command acts before it arrived.
"""

from __future__ import annotations

import sys
from typing import Any

from rclpy.node import Node
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_twin import topics
from pendulum_twin.command_hold import CommandHold
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.guard import guarded
from pendulum_twin.nodes.messages import joints_of, to_float, to_joint_state
from pendulum_twin.nodes.qos import LATEST, SAMPLES
from pendulum_twin.nodes.running import run
from pendulum_twin.nodes.settings import declared
from pendulum_twin.nodes.twin_settings import TwinSettings
from pendulum_twin.sample_clock import SampleClock
from pendulum_twin.stepper import Stepper


class TwinNode(Node):
    """Run one twin in real time; raise BadInputError when a parameter or the twin file is wrong."""

    def __init__(self, **options: Any) -> None:
        super().__init__("twin", **options)
        try:
            settings = declared(self, TwinSettings)
            twin = load_twin(settings.twin)
        except BadInputError:
            self.destroy_node()
            raise
        self._joints = joints_of(twin.rig)
        self._stepper = _warm(Stepper(twin, 1 / settings.rate_hz))
        self._hold = CommandHold(twin.rig.pwm_limit, settings.command_timeout_s)
        self._samples = SampleClock(1 / settings.rate_hz)
        self._states = self.create_publisher(JointState, topics.JOINT_STATES, SAMPLES)
        self._applied = self.create_publisher(Float64, topics.APPLIED_PWM, SAMPLES)
        self.create_subscription(Float64, topics.PWM, self.on_command, LATEST)
        self.create_service(Trigger, topics.RESET, self.on_reset)
        self.create_timer(1 / settings.rate_hz, self.on_timer)
        self.get_logger().info(f"twin {twin.name} of {settings.twin} runs at {settings.rate_hz:g} Hz")

    @property
    def refused(self) -> int:
        """Return how many commands were refused."""
        return self._hold.refused

    def fail_safe(self) -> None:
        """Hold no command."""
        self._hold.clear()

    @guarded
    def on_timer(self) -> None:
        """Publish what is due, usually one sample."""
        for stamp_ns in self._samples.due(self._now_ns()):
            self._states.publish(to_joint_state(self._joints, self._stepper.state, stamp_ns))
            command = self._hold.at(stamp_ns)
            self._applied.publish(to_float(command))
            self._stepper.step(command)

    @guarded
    def on_command(self, message: Float64) -> None:
        """Take a command, or refuse what is no number."""
        if not self._hold.offer(message.data, self._now_ns()):
            self.get_logger().warning(
                f"{topics.PWM}: expected a finite number, found {message.data} ({self._hold.refused} refused so far)",
                throttle_duration_sec=1.0,
            )

    @guarded
    def on_reset(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Start again, hanging at rest in the middle of the rail."""
        self._hold.clear()
        self._stepper.reset()
        response.success, response.message = True, "the pendulum hangs at rest in the middle of the rail"
        return response

    def _now_ns(self) -> int:
        return self.get_clock().now().nanoseconds


def _warm(stepper: Stepper) -> Stepper:
    """Return the stepper with its kernel compiled, so that the first sample is not late."""
    stepper.step(0.0)
    stepper.reset()
    return stepper


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    return run("twin_node", "The digital twin in real time.", TwinSettings, TwinNode, arguments)


if __name__ == "__main__":
    sys.exit(main())
