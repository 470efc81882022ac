"""How a plan stands, said to others: its progress and outcome on topics, and lines of the log."""

from __future__ import annotations

from time import monotonic

from rclpy.duration import Duration
from rclpy.node import Node
from std_msgs.msg import Float64, String

from pendulum_bridge.excitation.run import (
    Run,
    compute_share,
    describe_outcome,
    describe_progress,
)
from pendulum_bridge.nodes.pendulum_client import DELIVERY_S
from pendulum_twin import topics
from pendulum_twin.nodes.messages import to_float
from pendulum_twin.nodes.qos import LATCHED
from pendulum_twin.plans.excitation import Excitation

PROGRESS_S, LOG_S = 0.5, 5.0  # time between messages of progress, and between lines of the log


class Reports:
    """Say how a plan stands.

    node: publishes and logs.
    plan: that is played.
    logs_failure: whether a plan that was stopped is logged; else the program says it at its end.
    """

    def __init__(self, node: Node, plan: Excitation, logs_failure: bool) -> None:
        self._node, self._plan, self._logs_failure = node, plan, logs_failure
        self._progress = node.create_publisher(Float64, topics.PROGRESS, LATCHED)
        self._outcome = node.create_publisher(String, topics.OUTCOME, LATCHED)
        self._reported_s = self._said_s = monotonic()

    def announce(self, run: Run) -> None:
        """Publish progress and outcome, and log that another stage has begun."""
        self._reported_s = self._said_s = monotonic()
        self._progress.publish(to_float(compute_share(run, self._plan)))
        self._outcome.publish(String(data=describe_outcome(run)))
        if run.stopped is None:
            self._node.get_logger().info(describe_progress(run, self._plan))
        elif self._logs_failure:
            self._node.get_logger().error(run.stopped.sentence)

    def report(self, run: Run, now: float) -> None:
        """Publish the progress and log it, each when it is due."""
        if now - self._reported_s >= PROGRESS_S:
            self._reported_s = now
            self._progress.publish(to_float(compute_share(run, self._plan)))
        if now - self._said_s >= LOG_S:
            self._said_s = now
            self._node.get_logger().info(describe_progress(run, self._plan))

    def tell_lacking(self, lacking: str, now: float) -> None:
        """Log what the plan still waits for, when a line is due."""
        if now - self._said_s >= LOG_S:
            self._said_s = now
            self._node.get_logger().info(f"still waits: {lacking}")

    def deliver(self) -> None:
        """Wait until the outcome has arrived, for a while at most."""
        self._outcome.wait_for_all_acked(Duration(seconds=DELIVERY_S))
