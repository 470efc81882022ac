"""Name the qualities of service of the graph; all are reliable."""

from __future__ import annotations

from rclpy.qos import DurabilityPolicy, QoSProfile

SAMPLES = QoSProfile(depth=10)  # samples, and what was applied
LATEST = QoSProfile(depth=1)  # commands: only the last one counts
# a state that a late subscriber has to see, too
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
