"""The hardware driver: samples of the rig out as topics, commands in, decisions between them.

A thread of its own waits for the rig; whoever spins the node serves ROS. Both threads decide, and
send at once.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import replace
from threading import Event, Thread
from typing import Any

import numpy as np
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import QoSProfile
from rclpy.task import Future
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float64
from std_srvs.srv import Trigger

from pendulum_bridge.driver.driver import Driver
from pendulum_bridge.driver.last_word import LastWord
from pendulum_bridge.driver.parent import Parent
from pendulum_bridge.nodes.driver_settings import DriverSettings
from pendulum_bridge.safety.decide import Rules, make_rules
from pendulum_bridge.safety.limits import Limits
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.signs import find_ways
from pendulum_bridge.safety.watchdog import Timeouts
from pendulum_bridge.wire.link import Link
from pendulum_bridge.wire.protocol import Command
from pendulum_bridge.wire.tcp import open_tcp_link
from pendulum_bridge.wire.udp import Address
from pendulum_twin import topics
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.guard import guard_method
from pendulum_twin.nodes.messages import list_joints, to_float, to_joint_state
from pendulum_twin.nodes.qos import LATCHED, LATEST, SAMPLES
from pendulum_twin.nodes.running import run
from pendulum_twin.nodes.settings import declare_settings, watch_settings

LONGEST_WAIT_S = 0.05  # until a signal, or the end of the parent, is seen
# turns of the executor, a tenth of LONGEST_WAIT_S each, for answers to waiting callers
LAST_ANSWERS = 20
# longest wait for the thread, which waits for the rig at most 20 ms; PWM 0 is sent anyway
THREAD_ENDS_S = 1.0
# a queue, as of two messages at the same moment a queue of 1 shows only the last
EVERY_WRITER = QoSProfile(depth=100)
SWITCH_S = 0.0005  # Python switches between busy threads after so long, instead of 5 ms


class DriverNode(Node):
    """Drive a rig; raise BadInputError when a parameter, the twin file or the address is wrong.

    settings: the parameters.
    driver: the driver without ROS.
    waiting: number of callers that wait for the end of a reset.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("driver", **options)
        try:
            self.settings = declare_settings(self, DriverSettings)
            self._twin = load_twin(self.settings.twin)
            self.driver = make_driver(self.settings, self._twin, Outlet(self, self._twin))
        except BadInputError:
            super().destroy_node()
            raise
        self.waiting = 0  # callers that wait for the end of a reset
        self._ended = Event()
        self._thread = Thread(
            target=self.driver.serve, args=(self._ended,), name="rig", daemon=True
        )
        self._listen()
        self._thread.start()
        self.get_logger().info(
            f"drives {self._twin.name} of {self.settings.twin}: {self.settings.wire}"
        )

    def _listen(self) -> None:
        self.create_subscription(Float64, topics.PWM, self.on_command, LATEST)
        self.create_subscription(Float64, topics.PWM, self.on_heard, EVERY_WRITER, raw=True)
        self.create_service(Trigger, topics.STOP, self.on_stop)
        self.create_service(Trigger, topics.CLEAR_STOP, self.on_clear_stop)
        # a group of its own: a reset answers seconds later, and all else is served meanwhile
        self.create_service(
            Trigger, topics.RESET, self.on_reset, callback_group=ReentrantCallbackGroup()
        )
        watch_settings(self, lambda: self.settings, self._change)
        publish_health(self, self._twin.name, self.health)

    def fail_safe(self) -> None:
        """Bring PWM to 0 after a failure."""
        self.driver.fail_safe()

    def finish(self) -> None:
        """Send PWM 0 and release the rig; a second call does nothing."""
        self._ended.set()
        self._thread.join(THREAD_ENDS_S)
        self.driver.close()

    def destroy_node(self) -> None:
        """Finish, then destroy the node."""
        self.finish()
        super().destroy_node()

    @guard_method
    def on_command(self, message: Float64, info: dict[str, Any]) -> None:
        """Act on a command at once."""
        refused = self.driver.command(message.data, info["source_timestamp"])
        if refused is not None:
            self.get_logger().warning(
                f"{topics.PWM} {message.data}: {refused.sentence}", throttle_duration_sec=1.0
            )

    @guard_method
    def on_heard(self, packed: bytes, info: dict[str, Any]) -> None:
        """Note the writer's sequence number, to detect two writers.

        A middleware without such numbers gives None; then two writers go unnoticed.
        """
        if (number := info["publication_sequence_number"]) is not None:
            self.driver.hear_writer(number)

    @guard_method
    def on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Latch the emergency stop."""
        return fill_answer(self.driver.stop(), response, success=True)

    @guard_method
    def on_clear_stop(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Clear the emergency stop, or say why it stays."""
        reason = self.driver.clear_stop()
        return fill_answer(reason, response, reason.level is Level.OK)

    async def on_reset(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Answer when the pendulum hangs at rest in the middle of the rail, or why it does not."""
        executor, ended = self.executor, Future()
        self.waiting += 1

        def finish(reason: Reason) -> None:
            ended.set_result(reason)
            if executor is not None:
                with suppress(InvalidHandle):  # the executor may have ended
                    executor.wake()

        try:
            self.driver.reset(finish)
            reason = await ended
        except Exception as error:
            self.fail_safe()
            return Trigger.Response(success=False, message=repr(error))
        finally:
            self.waiting -= 1
        return fill_answer(reason, response, reason is Reason.RESET_DONE)

    @guard_method
    def health(self) -> Health:
        """Return the driver's health with the address of its rig."""
        health = self.driver.health()
        return replace(health, figures={"link": self.settings.wire, **health.figures})

    def _change(self, settings: DriverSettings) -> None:
        self.driver.change_rules(collect_rules(settings, self._twin))
        self.settings = settings


def fill_answer(reason: Reason, response: Trigger.Response, success: bool) -> Trigger.Response:
    """Return a service's answer with the reason's sentence."""
    response.success, response.message = success, reason.sentence
    return response


class Outlet:
    """Publish the driver's output."""

    def __init__(self, node: Node, twin: Twin) -> None:
        self._states = node.create_publisher(JointState, topics.JOINT_STATES, SAMPLES)
        self._applied = node.create_publisher(Float64, topics.APPLIED_PWM, SAMPLES)
        self._stopped = node.create_publisher(Bool, topics.STOPPED, LATCHED)
        self._joints = list_joints(twin.rig)
        self._logger = node.get_logger()
        self.publish_stopped(False)

    def publish_sample(self, state: RigState, stamp_ns: int) -> None:
        """Publish a sample."""
        row = np.array([state.cart_m, state.pole_rad, state.cart_m_s, state.pole_rad_s])
        self._states.publish(to_joint_state(self._joints, row, stamp_ns))

    def publish_applied(self, pwm: float) -> None:
        """Publish the command that was sent."""
        self._applied.publish(to_float(pwm))

    def publish_stopped(self, latched: bool) -> None:
        """Publish whether the emergency stop is latched."""
        self._stopped.publish(Bool(data=latched))

    def report_failure(self, error: Exception) -> None:
        """Log an error of the thread that serves the rig."""
        self._logger.error(
            f"serving the rig failed, PWM is 0: {error!r}", throttle_duration_sec=1.0
        )


def make_driver(settings: DriverSettings, twin: Twin, outlet: Outlet) -> Driver:
    """Return the driver of a rig.

    Raises BadInputError when the rig cannot be driven or reached.
    """
    rules, link = collect_rules(settings, twin), make_link(settings)
    try:
        last_word = LastWord(link, Command(0.0).pack())
        return Driver(link, rules, outlet, last_word, lossless=settings.transport == "tcp")
    except BadInputError:
        link.close()
        raise


def make_link(settings: DriverSettings) -> Link:
    """Return the link to the rig; raise BadInputError when an address cannot be used."""
    rig = Address(settings.rig_host, settings.rig_port)
    if settings.transport == "tcp":
        return open_tcp_link(rig)
    return Link(Address(settings.listen_host, settings.listen_port), rig)


def collect_rules(settings: DriverSettings, twin: Twin) -> Rules:
    """Return the rules of the decisions; raise BadInputError for a rig that cannot be driven."""
    way, pole_way = find_ways(twin.effects)
    return make_rules(
        twin.rig,
        Limits(settings.pwm_limit, settings.slew_per_s),
        Timeouts(settings.command_timeout_s, settings.rig_timeout_s),
        way,
        pole_way,
        1 / settings.rate_hz,
        settings.reset_deadline_s,
    )


def serve(node: DriverNode, stopped: Event) -> None:
    """Serve the node until stopped is set, or its parent has ended; then answer waiting callers.

    The end of the parent counts only for a node with the setting end_with_parent.
    """
    parent = Parent() if node.settings.end_with_parent else None
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        while not stopped.is_set() and not (parent and parent.ended):
            executor.spin_once(timeout_sec=LONGEST_WAIT_S)
        node.finish()
        for _ in range(LAST_ANSWERS if node.waiting else 0):
            executor.spin_once(timeout_sec=0.1 * LONGEST_WAIT_S)
    finally:
        executor.shutdown()


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    sys.setswitchinterval(SWITCH_S)
    return run("driver_node", "The rig's driver.", DriverSettings, DriverNode, arguments, serve)


if __name__ == "__main__":
    sys.exit(main())
