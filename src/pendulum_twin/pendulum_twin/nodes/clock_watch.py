"""Say so when simulated time stands still: a node that waits for `/clock` would wait silently."""

from __future__ import annotations

from time import monotonic

from rclpy.clock import Clock, ClockType
from rclpy.node import Node

STANDS_AFTER_S = 1.0  # of real time without a step of `/clock`
LOOK_S = 0.25
STANDS = (
    "use_sim_time is true, but /clock does not move, so that no sample is due: start the node "
    "that publishes /clock, or start this node with use_sim_time:=false "
    "(a twin with lockstep:=true publishes /clock itself)"
)


class ClockWatch:
    """Watch the time of a node that follows `/clock`, by real time.

    trouble: what keeps time from moving, in a sentence; empty while it moves.
    """

    def __init__(self, node: Node) -> None:
        self.trouble = ""
        self._node = node
        self._seen_ns, self._moved_s = self._read_ns(), monotonic()
        node.create_timer(LOOK_S, self._look, clock=Clock(clock_type=ClockType.STEADY_TIME))

    def _look(self) -> None:
        now_ns, now_s, before = self._read_ns(), monotonic(), self.trouble
        if now_ns != self._seen_ns:
            self._seen_ns, self._moved_s = now_ns, now_s
        self.trouble = STANDS if now_s - self._moved_s >= STANDS_AFTER_S else ""
        if self.trouble and not before:
            self._node.get_logger().error(self.trouble)
        elif before and not self.trouble:
            self._node.get_logger().info("/clock moves: samples come")

    def _read_ns(self) -> int:
        return int(self._node.get_clock().now().nanoseconds)
