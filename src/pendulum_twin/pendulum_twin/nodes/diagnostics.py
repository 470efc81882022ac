"""Publish a node's health on `/diagnostics`, once a second."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.clock import Clock, ClockType
from rclpy.node import Node

from pendulum_twin import topics
from pendulum_twin.health import Health, Level
from pendulum_twin.nodes.messages import to_time
from pendulum_twin.nodes.qos import SAMPLES

PERIOD_S = 1.0


def publish_health(node: Node, hardware: Callable[[], str], health: Callable[[], Health]) -> None:
    """Publish a node's health once a second of real time, whatever the simulated time is.

    hardware: returns the name of the rig.
    health: returns what to publish.

    What they raise is logged and published as an ERROR: it would end the node.
    """
    publisher = node.create_publisher(DiagnosticArray, topics.DIAGNOSTICS, SAMPLES)

    def publish() -> None:
        name, rig = node.get_fully_qualified_name(), ""
        try:
            rig = hardware()
            message = to_diagnostics(name, rig, health(), read_time_ns(node))
        except Exception as error:
            if not node.context.ok():
                return
            sentence = f"The health of {name} could not be told: {error!r}"
            node.get_logger().error(sentence, throttle_duration_sec=60.0)
            failed = Health(Level.ERROR, sentence)
            message = to_diagnostics(name, rig, failed, read_time_ns(node))
        publisher.publish(message)

    node.create_timer(PERIOD_S, publish, clock=Clock(clock_type=ClockType.STEADY_TIME))


def read_time_ns(node: Node) -> int:
    """Return the node's time, ns."""
    return int(node.get_clock().now().nanoseconds)


def to_diagnostics(name: str, hardware: str, health: Health, stamp_ns: int) -> DiagnosticArray:
    """Return a node's health as a message."""
    status = DiagnosticStatus(
        level=bytes([health.level]),
        name=name,
        message=health.sentence,
        hardware_id=hardware,
        values=[
            KeyValue(key=key, value=_format_value(value)) for key, value in health.figures.items()
        ],
    )
    message = DiagnosticArray(status=[status])
    message.header.stamp = to_time(stamp_ns)
    return message


def _format_value(value: float | str) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
