"""Report on /diagnostics which part of the rig has changed, since when and by how much.

The node loads the twin file that a diagnosis has improved, learns from some seconds of motion what
is usual for the rig, and then watches. An alarm stays until `~/clear_alarm` is called (what is
usual is kept) or `~/learn` (the present rig becomes the usual). The node sends no command.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable
from time import monotonic
from typing import Any

from rclpy.node import Node
from rclpy.qos import QoSProfile
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_bridge.nodes.watch_settings import WatchSettings
from pendulum_bridge.watch.health import describe_health
from pendulum_bridge.watch.in_order import InOrder, Said
from pendulum_bridge.watch.watch import Watch
from pendulum_twin import topics
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health
from pendulum_twin.model import load_twin
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.messages import from_joint_state, from_time
from pendulum_twin.nodes.running import run
from pendulum_twin.nodes.settings import declare_settings, watch_settings

# learning and naming take a second or two, in which nothing may be lost
QUEUE = QoSProfile(depth=5000)


class WatchNode(Node):
    """Watch a rig; raise BadInputError when a parameter or the twin file is wrong."""

    def __init__(self, **options: Any) -> None:
        super().__init__("watch", **options)
        try:
            self._settings = declare_settings(self, WatchSettings)
            twin = load_twin(self._settings.twin)
        except BadInputError:
            self.destroy_node()
            raise
        self._in_order = InOrder()
        self._heard_s: float | None = None
        self._watch, self._rig_name = Watch(twin, self._settings.watching), twin.name
        rig = self._settings.rig.rstrip("/")
        self._listen(JointState, f"{rig}/{topics.JOINT_STATES}", self.on_sample)
        self._listen(Float64, f"{rig}/{topics.APPLIED_PWM}", self.on_applied)
        self.create_service(Trigger, "~/clear_alarm", self.on_clear_alarm)
        self.create_service(Trigger, "~/learn", self.on_learn)
        watch_settings(self, lambda: self._settings, self._accept)
        publish_health(self, lambda: self._rig_name, self.health)
        self.get_logger().info(f"watches {rig} with the twin {twin.name} of {self._settings.twin}")

    def on_sample(self, message: JointState, info: dict[str, Any]) -> None:
        """Pass on a sample of the rig."""
        try:
            state = from_joint_state(message)
        except BadInputError as error:
            self.get_logger().warning(str(error), throttle_duration_sec=1.0)
            return
        cart, pole = (
            float(state[k]) if joint in message.name else math.nan
            for k, joint in enumerate(topics.JOINTS)
        )
        self._heard_s = monotonic()
        self._in_order.sample(
            Said(from_time(message.header.stamp), int(info["source_timestamp"]), (cart, pole))
        )
        self._take()

    def on_applied(self, message: Float64, info: dict[str, Any]) -> None:
        """Pass on an applied command."""
        said_ns = int(info["source_timestamp"])
        self._watch.command(message.data, said_ns)
        self._in_order.command(said_ns)
        self._take()

    def _take(self) -> None:
        for said in self._in_order.due():
            phase = self._watch.phase
            alarm = self._watch.sample(said.stamp_ns, said.said_ns, said.positions)
            if alarm is not None:
                self.get_logger().error(f"{self._settings.rig} has changed: {alarm.sentence}")
            elif self._watch.phase is not phase:
                self.get_logger().info(self.health().sentence)

    def on_clear_alarm(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Forget the alarm; it comes again if the change is still there."""
        was = self._watch.alarm
        self._watch.clear()
        response.success = True
        response.message = f"cleared: {was.sentence}" if was else "there was no alarm"
        return response

    def on_learn(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Take the present rig as the usual."""
        self._watch.learn()
        response.success, response.message = (
            True,
            f"learns from {self._settings.learn_s:g} s of motion",
        )
        return response

    def health(self) -> Health:
        """Return the rig's health."""
        silent_s = None if self._heard_s is None else monotonic() - self._heard_s
        return describe_health(self._watch, self._settings.rig, silent_s)

    def _accept(self, settings: WatchSettings) -> None:
        """Continue with another twin file.

        Raises BadInputError with nothing changed if it is wrong.
        """
        twin = load_twin(settings.twin)
        self._watch, self._rig_name = Watch(twin, settings.watching), twin.name
        self._settings, self._in_order = settings, InOrder()
        self.get_logger().info(
            f"goes on with the twin {twin.name} of {settings.twin}, and learns anew"
        )

    def _listen(self, kind: type, topic: str, take: Callable[[Any, dict[str, Any]], None]) -> None:
        def taken(message: Any, info: dict[str, Any]) -> None:
            try:
                take(message, info)
            except Exception as error:  # an uncaught error would end the node
                self.get_logger().error(
                    f"{topic}: a message could not be taken: {error!r}", throttle_duration_sec=1.0
                )

        listener: Callable[..., None] = taken
        self.create_subscription(kind, topic, listener, QUEUE)


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    description = (
        "An alarm on /diagnostics when the rig no longer moves as its twin says, naming the place "
        "that changed."
    )
    return run("watch_node", description, WatchSettings, WatchNode, arguments)


if __name__ == "__main__":
    sys.exit(main())
