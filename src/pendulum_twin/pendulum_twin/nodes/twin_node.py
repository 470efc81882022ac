"""The live twin: commands in, samples out in real time, by the same names and types as the rig.

At every sampling time the node publishes the sample, decides the command (the last that arrived; clipped, 0 when
stale), publishes it as applied, and holds it to the next sampling time: no command acts before it arrived.
"""

from __future__ import annotations

import argparse
import signal
import sys
from collections.abc import Callable
from functools import wraps
from threading import Event
from typing import Any

import rclpy
from rclpy._rclpy_pybind11 import RCLInvalidROSArgsError, UnknownROSArgsError
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_twin import topics
from pendulum_twin.command_hold import CommandHold
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.messages import joints_of, to_float, to_joint_state
from pendulum_twin.nodes.settings import declared, described
from pendulum_twin.sample_clock import SampleClock
from pendulum_twin.stepper import Stepper

LATEST, QUEUE = QoSProfile(depth=1), QoSProfile(depth=10)  # both reliable: rclpy's default
LONGEST_WAIT_S = 0.2  # until a signal is seen


def guarded(callback: Callable[..., Any]) -> Callable[..., Any]:
    """Keep the node alive when a callback fails: say so, and hold no command. A failed service answers so."""

    @wraps(callback)
    def run(self: TwinNode, *arguments: Any) -> Any:
        try:
            return callback(self, *arguments)
        except Exception as error:
            if not self.context.ok():
                return None
            self._hold.clear()
            self.get_logger().error(f"{callback.__name__} failed, PWM is 0: {error!r}", throttle_duration_sec=1.0)
            return Trigger.Response(success=False, message=repr(error)) if len(arguments) == 2 else None

    return run


class TwinNode(Node):
    """Run one twin in real time; raise BadInputError when a parameter or the twin file is wrong."""

    def __init__(self, **options: Any) -> None:
        super().__init__("twin", **options)
        try:
            settings = declared(self)
            twin = load_twin(settings.twin)
        except BadInputError:
            self.destroy_node()
            raise
        self._joints = joints_of(twin.rig)
        self._stepper = _warm(Stepper(twin, 1 / settings.rate_hz))
        self._hold = CommandHold(twin.rig.pwm_limit, settings.command_timeout_s)
        self._samples = SampleClock(1 / settings.rate_hz)
        self._states = self.create_publisher(JointState, topics.JOINT_STATES, QUEUE)
        self._applied = self.create_publisher(Float64, topics.APPLIED_PWM, QUEUE)
        self.create_subscription(Float64, topics.PWM, self.on_command, LATEST)
        self.create_service(Trigger, topics.RESET, self.on_reset)
        self.create_timer(1 / settings.rate_hz, self.on_timer)
        self.get_logger().info(f"twin {twin.name} of {settings.twin} runs at {settings.rate_hz:g} Hz")

    @property
    def refused(self) -> int:
        """Return how many commands were refused."""
        return self._hold.refused

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
    """Run the node until SIGINT or SIGTERM and return 0.

    Returns 1 with a sentence on stderr when a parameter or the twin file is wrong or ROS cannot run, 2 for wrong use.
    """
    arguments = sys.argv if arguments is None else arguments
    try:
        _parser().parse_args(remove_ros_args(arguments)[1:])
        stopped = _signalled()
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        _spin(TwinNode(), stopped)
    except BadInputError as error:
        print(f"twin_node: {error}", file=sys.stderr)
        return 1
    except (RCLInvalidROSArgsError, UnknownROSArgsError) as error:
        print(f"twin_node: wrong --ros-args: {str(error).splitlines()[0]}", file=sys.stderr)
        return 2
    except RuntimeError as error:  # what else rclpy raises: a name that is none, no middleware
        print(f"twin_node: ROS cannot run it: {str(error).splitlines()[0]}", file=sys.stderr)
        return 1
    finally:
        rclpy.try_shutdown()
    return 0


def _signalled() -> Event:
    """Return what SIGINT and SIGTERM set; rclpy's own handlers raise whatever the node is doing, start-up included."""
    stopped = Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, lambda *_: stopped.set())
    return stopped


def _spin(node: TwinNode, stopped: Event) -> None:
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        while not stopped.is_set():
            executor.spin_once(timeout_sec=LONGEST_WAIT_S)
    finally:
        executor.shutdown()
        node.destroy_node()


def _parser() -> argparse.ArgumentParser:
    return argparse.ArgumentParser(
        prog="twin_node",
        description="The digital twin in real time. Parameters (--ros-args -p NAME:=VALUE):\n" + described(),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


if __name__ == "__main__":
    sys.exit(main())
