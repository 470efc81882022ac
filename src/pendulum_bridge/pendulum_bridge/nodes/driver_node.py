"""The hardware driver: samples of the rig out as topics, commands in, decisions between them.

A lifecycle node. Unconfigured it has no link to the rig; inactive it publishes samples and sends
0; active it accepts commands. It sends PWM 0 whenever it leaves `active`, and latches the
emergency stop after a transition that failed. The latch outlasts every transition. With the
parameter `autostart` the node configures and activates itself.

A thread of its own waits for the rig; whoever spins the node serves ROS. Both threads decide, and
send at once.
"""

from __future__ import annotations

import sys
from contextlib import suppress
from dataclasses import replace
from threading import Event, Thread
from time import monotonic
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.exceptions import InvalidHandle
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.qos import QoSProfile
from rclpy.task import Future
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

from pendulum_bridge.driver.driver import Driver
from pendulum_bridge.driver.parent import Parent
from pendulum_bridge.driver.parked_stop import ParkedStop
from pendulum_bridge.nodes.driver_making import collect_rules, describe_limits, make_driver
from pendulum_bridge.nodes.driver_outlet import DriverOutlet
from pendulum_bridge.nodes.driver_settings import DriverSettings
from pendulum_bridge.nodes.lifecycle import guard_transitions
from pendulum_bridge.safety.reasons import Level, Reason
from pendulum_twin import topics
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health
from pendulum_twin.model import Twin, load_twin
from pendulum_twin.nodes.diagnostics import publish_health
from pendulum_twin.nodes.guard import guard_method
from pendulum_twin.nodes.qos import LATEST
from pendulum_twin.nodes.running import run
from pendulum_twin.nodes.settings import declare_settings, watch_settings
from pendulum_twin.stop_request import StopRequest

LONGEST_WAIT_S = 0.05  # until a signal, or the end of the parent, is seen
# longest wait for the answers to waiting callers: other messages may wait before them
ANSWERED_S = 2.0
DELIVERED_S = 0.3  # after the last answer: a packet that was lost is sent again by this process
# longest wait for the thread, which waits for the rig at most 20 ms; PWM 0 is sent anyway
THREAD_ENDS_S = 1.0
# a queue, as of two messages at the same moment a queue of 1 shows only the last
EVERY_WRITER = QoSProfile(depth=100)
SWITCH_S = 0.0005  # Python switches between busy threads after so long, instead of 5 ms


UNCONFIGURED = (
    "The driver is not configured: it has no link to the rig, and PWM is 0. Configure and "
    "activate it (ros2 lifecycle set)."
)
SUCCESS, FAILURE = TransitionCallbackReturn.SUCCESS, TransitionCallbackReturn.FAILURE


class DriverNode(LifecycleNode):
    """Drive a rig; raise BadInputError when a parameter is wrong.

    settings: the parameters.
    driver: the driver without ROS; None while the node is unconfigured.
    waiting: number of callers that wait for the end of a reset.
    left: that the rig may hold a command since `finish`, in a sentence; empty when it got PWM 0.
    """

    def __init__(self, **options: Any) -> None:
        super().__init__("driver", **options)
        try:
            self.settings = declare_settings(self, DriverSettings)
        except BadInputError:
            super().destroy_node()
            raise
        self.driver: Driver | None = None
        self.waiting = 0
        self.left = ""
        self._twin: Twin | None = None  # of the last configuring, whatever becomes of its file
        self._failure = ""  # why the last configuring failed
        self._parked = ParkedStop()  # the emergency stop, while there is no driver to hold it
        self._ended = Event()
        self._thread: Thread | None = None
        self._outlet = DriverOutlet(self)
        guard_transitions(self)
        self._listen()

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
        publish_health(self, self._name_rig, self.health)

    def start(self) -> None:
        """Configure and activate; raise BadInputError with the reason when that fails."""
        if self.trigger_configure() is not SUCCESS or self.trigger_activate() is not SUCCESS:
            raise BadInputError(self._failure or "the driver could not be started: see its log")

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Check limits and twin file, open the link, and publish samples from now on."""
        try:
            twin = load_twin(self.settings.twin)
            self._outlet.show(twin.rig)
            self._twin = twin
            self.driver = make_driver(self.settings, twin, self._outlet)
            rules = collect_rules(self.settings, twin)
        except BadInputError as error:
            self._failure = str(error)
            if not self.settings.autostart:  # else the program says it at its end
                self.get_logger().error(f"not configured: {error}")
            return FAILURE
        self._outlet.publish_limit(rules.limits.magnitude)
        if self._parked.latched:
            self.driver.stop()
        self._ended = Event()
        self._thread = Thread(
            target=self.driver.serve, args=(self._ended,), name="rig", daemon=True
        )
        self._thread.start()
        self.get_logger().info(
            f"drives {twin.name} of {self.settings.twin}: {self.settings.wire}; "
            f"{describe_limits(rules, self.settings)}"
        )
        return SUCCESS

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Accept commands and resets from now on."""
        self._get_driver().activate()
        self.get_logger().info("active: commands are accepted")
        return SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Send PWM 0, and nothing else until the node is active again."""
        self._get_driver().deactivate()
        self.get_logger().info("inactive: PWM is 0, and commands are dropped")
        return SUCCESS

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Send PWM 0 and release the rig."""
        self.finish()
        return SUCCESS

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Send PWM 0 and release the rig."""
        self.finish()
        return SUCCESS

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Send PWM 0, latch the emergency stop and release the rig."""
        self.get_logger().error(
            f"a transition out of the state {state.label} failed: PWM is 0, and the emergency "
            "stop is latched"
        )
        if self.driver is not None:
            self.driver.stop()
        self._latch(True)
        self.finish()
        return SUCCESS

    def fail_safe(self) -> None:
        """Bring PWM to 0 after a failure."""
        if self.driver is not None:
            self.driver.fail_safe()

    def finish(self) -> None:
        """Send PWM 0 and release the rig; a second call does nothing."""
        self._ended.set()
        if self._thread is not None:
            self._thread.join(THREAD_ENDS_S)
        if self.driver is not None:
            latched = self.driver.needs_person
            if left := self.driver.close():
                self.left = left
                self.get_logger().error(left)
            self._latch(latched)
        self.driver = self._thread = None

    def destroy_node(self) -> None:
        """Finish, then destroy the node."""
        self.finish()
        super().destroy_node()

    def _get_driver(self) -> Driver:
        if self.driver is None:
            raise BadInputError("expected a configured driver, found none")
        return self.driver

    def _latch(self, latched: bool) -> None:
        """Keep and publish the emergency stop of a node without a driver."""
        self._parked.put(latched)
        self._outlet.publish_stopped(latched)

    @guard_method
    def on_command(self, message: Float64, info: dict[str, Any]) -> None:
        """Act on a command at once."""
        if self.driver is None:
            self._parked.drop_command(message.data)
            return
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
        if self.driver is not None and (number := info["publication_sequence_number"]) is not None:
            self.driver.hear_writer(number)

    @guard_method
    def on_stop(self, request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        """Latch the emergency stop."""
        if self.driver is None:
            self._latch(True)
            return fill_answer(Reason.STOPPED, response, success=True)
        return fill_answer(self.driver.stop(), response, success=True)

    @guard_method
    def on_clear_stop(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Clear the emergency stop, or say why it stays."""
        if self.driver is None:
            reason = self._parked.clear(self.settings.timeouts_s[0])
            self._outlet.publish_stopped(self._parked.latched)
        else:
            reason = self.driver.clear_stop()
        return fill_answer(reason, response, reason.level is Level.OK)

    async def on_reset(
        self, request: Trigger.Request, response: Trigger.Response
    ) -> Trigger.Response:
        """Answer when the pendulum hangs at rest in the middle of the rail, or why it does not."""
        if self.driver is None:
            return fill_answer(Reason.RESET_INACTIVE, response, success=False)
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

    def health(self) -> Health:
        """Return the driver's health with the address of its rig; a failure brings PWM to 0."""
        if self.driver is None:
            return Health(Level.WARN, UNCONFIGURED, {"link": "none", "active": 0})
        try:
            health = self.driver.health()
        except Exception:
            self.fail_safe()
            raise  # `publish_health` says it
        return replace(health, figures={"link": self.settings.wire, **health.figures})

    def _name_rig(self) -> str:
        return "rig" if self._twin is None else self._twin.name

    def _change(self, settings: DriverSettings) -> None:
        if self.driver is not None and self._twin is not None:
            rules = collect_rules(settings, self._twin)
            self.driver.change_rules(rules)
            self._outlet.publish_limit(rules.limits.magnitude)
            self.get_logger().info(describe_limits(rules, settings))
        self.settings = settings


def fill_answer(reason: Reason, response: Trigger.Response, success: bool) -> Trigger.Response:
    """Return a service's answer with the reason's sentence."""
    response.success, response.message = success, reason.sentence
    return response


def serve(node: DriverNode, stopped: StopRequest) -> str | None:
    """Serve the node until stopped is set, or its parent has ended; then answer waiting callers.

    Returns that the rig may hold a command, because PWM 0 did not go out; None when it did.

    With the setting autostart the node configures and activates itself first. The end of the
    parent counts only for a node with the setting end_with_parent.
    """
    parent = Parent() if node.settings.end_with_parent else None  # first: a start takes seconds
    if node.settings.autostart:
        node.start()
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    try:
        while not stopped.is_set() and not (parent and parent.ended):
            executor.spin_once(timeout_sec=LONGEST_WAIT_S)
        node.finish()
        deadline_s = monotonic() + ANSWERED_S
        delivered_s = monotonic() + (DELIVERED_S if node.waiting else 0.0)
        while monotonic() < (deadline_s if node.waiting else delivered_s):
            executor.spin_once(timeout_sec=0.1 * LONGEST_WAIT_S)
        return node.left or None
    finally:
        executor.shutdown()


def main(arguments: list[str] | None = None) -> int:
    """Run the node, see `running.run`."""
    sys.setswitchinterval(SWITCH_S)
    return run("driver_node", "The rig's driver.", DriverSettings, DriverNode, arguments, serve)


if __name__ == "__main__":
    sys.exit(main())
