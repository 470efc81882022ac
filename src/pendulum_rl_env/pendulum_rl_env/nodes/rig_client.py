"""A node that commands one pendulum and takes its samples.

It has a context of its own, so several can live in one process.
"""

from __future__ import annotations

import itertools
import os
import time

import rclpy
from rclpy.context import Context
from rclpy.duration import Duration
from rclpy.exceptions import InvalidNamespaceException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.validate_namespace import validate_namespace
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_rl_env.pacing.link import Received
from pendulum_rl_env.transport import NoAnswerError
from pendulum_twin import topics
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.direct import DirectSubscription
from pendulum_twin.nodes.messages import from_joint_state, from_time, to_float
from pendulum_twin.nodes.qos import LATCHED, LATEST, SAMPLES
from pendulum_twin.nodes.transport import leave_shared_memory

CONNECT_S = 20.0  # for discovery, and for a program to start
DELIVERY_S = 0.5  # at most, for the last command
LIMIT_S = 2.0  # at most, for the limit of a rig that states one
SPIN_S = 0.1  # at most, without a look for Ctrl-C
_numbers = itertools.count()


class RigClient:
    """Speak with the rig of a namespace, in the domain that ROS_DOMAIN_ID says.

    namespace: of the driver, or of the twin.
    name: the namespace in full.
    unreadable: what was wrong with the last sample; empty when it could be read.
    pwm_limit: the largest command that the rig takes, as of the last `connect` or `reset`; None
        while the rig has stated none.

    Raises BadInputError when the namespace is not valid or ROS cannot run. `close` it after use.
    This process speaks UDP with ROS from then on (`pendulum_twin.nodes.transport`).
    """

    def __init__(self, namespace: str) -> None:
        self.name = _complete_namespace(namespace)
        self.unreadable = ""
        self.pwm_limit: float | None = None
        self._context = Context()
        leave_shared_memory()
        try:
            rclpy.init(args=[], context=self._context)  # not the program's own arguments
            self._node = Node(
                f"environment_{os.getpid()}_{next(_numbers)}",
                context=self._context,
                use_global_arguments=False,
            )
        except RuntimeError as error:
            self._context.try_shutdown()
            raise BadInputError(
                f"ROS cannot run the environment's node: {str(error).splitlines()[0]}"
            ) from error
        try:
            self._listen()
        except BaseException:  # else the node would stay in the graph without an owner
            self._end_node()
            raise

    def _listen(self) -> None:
        self._commands = self._node.create_publisher(Float64, self._topic(topics.PWM), LATEST)
        self._samples = DirectSubscription(
            self._node, JointState, self._topic(topics.JOINT_STATES), SAMPLES
        )
        self._limits = self._node.create_subscription(
            Float64, self._topic(topics.PWM_LIMIT), self._take_limit, LATCHED
        )
        self._resets = self._node.create_client(Trigger, self._topic(topics.RESET))
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def connect(self, timeout_s: float) -> None:
        """Return when the rig's node knows this node; raise NoAnswerError when it is not there.

        A rig that states its limit has stated it by then, if it does so within 2 s.
        """
        end_s = time.monotonic() + timeout_s
        while missing := self._find_missing():
            if (left_s := end_s - time.monotonic()) <= 0:
                raise NoAnswerError(
                    f"{self.name}: expected a rig's driver or a twin in this namespace, but "
                    f"{missing} within {timeout_s:g} s: see that it runs, under the same "
                    "ROS_DOMAIN_ID"
                )
            self._executor.spin_once(timeout_sec=min(SPIN_S, left_s))
        limit_end_s = min(end_s, time.monotonic() + LIMIT_S)
        while self._lacks_limit() and (left_s := limit_end_s - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=min(SPIN_S, left_s))

    def reset(self, timeout_s: float) -> str:
        """Ask for a reset and return the answer; raise NoAnswerError with the rig's reason."""
        name, end_s = self._topic(topics.RESET), time.monotonic() + timeout_s
        pending = self._resets.call_async(Trigger.Request())
        try:
            while not pending.done():
                if (left_s := end_s - time.monotonic()) <= 0:
                    raise NoAnswerError(
                        f"{name}: expected the pendulum to hang at rest within {timeout_s:.3g} s, "
                        "found no answer: see what the rig's driver says, then reset again"
                    )
                self._executor.spin_once(timeout_sec=min(SPIN_S, left_s))
        finally:
            self._resets.remove_pending_request(pending)
        answer = pending.result()
        if not answer.success:
            raise NoAnswerError(f"{name}: {answer.message}")
        return str(answer.message)

    def send(self, command: float) -> None:
        """Publish a command (PWM fraction)."""
        self._commands.publish(to_float(command))

    def wait(self, timeout_s: float) -> Received | None:
        """Return the oldest sample not taken yet, None after timeout_s; skip unreadable ones."""
        end_s = time.monotonic() + timeout_s
        while True:
            left_s = max(end_s - time.monotonic(), 0.0)
            message = self._samples.wait(min(left_s, SPIN_S))
            if message is None and left_s <= SPIN_S:
                return None
            if message is not None and (received := self._read(message)) is not None:
                return received

    def now_s(self) -> float:
        """Return the monotonic time, s."""
        return time.monotonic()

    def now_ns(self) -> int:
        """Return the node's time, which is the system's, ns."""
        return int(self._node.get_clock().now().nanoseconds)

    def close(self) -> None:
        """Publish PWM 0, see it delivered, and end the node."""
        try:
            self.send(0.0)
            self._commands.wait_for_all_acked(Duration(seconds=DELIVERY_S))
        finally:
            self._executor.shutdown()
            self._end_node()

    def _end_node(self) -> None:
        self._node.destroy_node()
        self._context.try_shutdown()

    def _topic(self, name: str) -> str:
        return f"{self.name.rstrip('/')}/{name}"

    def _take_limit(self, message: Float64) -> None:
        self.pwm_limit = float(message.data)

    def _lacks_limit(self) -> bool:
        """Return whether somebody states the rig's limit and has not been heard yet."""
        return self.pwm_limit is None and self._limits.get_publisher_count() > 0

    def _find_missing(self) -> str:
        """Return what the rig still lacks, as a clause; nothing when it can be used."""
        if not self._commands.get_subscription_count():
            return f"nobody listens to {self._topic(topics.PWM)}"
        if not self._samples.publishers:
            return f"nobody publishes {self._topic(topics.JOINT_STATES)}"
        return (
            "" if self._resets.service_is_ready() else f"nobody offers {self._topic(topics.RESET)}"
        )

    def _read(self, message: JointState) -> Received | None:
        try:
            if missing := [name for name in topics.JOINTS if name not in message.name]:
                raise BadInputError(
                    f"joint_states: expected a {' and a '.join(missing)}, found "
                    f"{list(message.name)}"
                )
            received = Received(
                from_joint_state(message), from_time(message.header.stamp), time.monotonic()
            )
        except BadInputError as error:
            self.unreadable = str(error)
            return None
        self.unreadable = ""
        return received


def _complete_namespace(namespace: str) -> str:
    """Return a namespace as the graph has it; raise BadInputError when it is not valid."""
    full = f"/{namespace.strip('/')}"
    try:
        validate_namespace(full)
    except InvalidNamespaceException as error:
        raise BadInputError(
            f"namespace: expected letters, digits and _, as in rig, found {namespace!r}"
        ) from error
    return full
