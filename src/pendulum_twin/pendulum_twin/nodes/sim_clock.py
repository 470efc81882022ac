"""Publish simulated time on `/clock`, rarely enough to cost its listeners little."""

from __future__ import annotations

import time

from rclpy.node import Node
from rosgraph_msgs.msg import Clock

from pendulum_twin import topics
from pendulum_twin.nodes.messages import to_time
from pendulum_twin.nodes.qos import LATEST

CLOCK_PERIOD_S = 0.01  # of wall time; each message costs every listening Python node about 0.2 ms


class SimClock:
    """Publish simulated time when it has moved, at most once in CLOCK_PERIOD_S of wall time."""

    def __init__(self, node: Node) -> None:
        self._publisher = node.create_publisher(Clock, topics.CLOCK, LATEST)
        self._published_s = -CLOCK_PERIOD_S
        self._stamp_ns = self._published_ns = -1

    def move(self, stamp_ns: int) -> None:
        """Set the time (ns), and publish it, or leave that to a later `catch_up`."""
        self._stamp_ns = stamp_ns
        self.catch_up()

    def catch_up(self) -> bool:
        """Publish the time if it has moved; return whether it has to be published later."""
        if self._stamp_ns == self._published_ns:
            return False
        now_s = time.monotonic()
        if now_s - self._published_s < CLOCK_PERIOD_S:
            return True
        self._publisher.publish(Clock(clock=to_time(self._stamp_ns)))
        self._published_s, self._published_ns = now_s, self._stamp_ns
        return False
