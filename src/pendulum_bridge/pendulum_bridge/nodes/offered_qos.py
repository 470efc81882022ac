"""Offered qualities of service: a request that fits all of them, and their names in a bag."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def choose_qos(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """Return the strictest request that every publisher fulfils.

    It is reliable if all publishers are, and transient local if all publishers are.

    offered: what the publishers offer.
    depth: messages that the subscription queues.
    """
    reliable = all(offer.reliability == ReliabilityPolicy.RELIABLE for offer in offered)
    latched = all(offer.durability == DurabilityPolicy.TRANSIENT_LOCAL for offer in offered)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def demands_more(request: QoSProfile, other: QoSProfile) -> bool:
    """Tell whether a request is stricter than another, so that a publisher may not fulfil it."""
    reliable, latched = ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL
    return (request.reliability == reliable != other.reliability) or (
        request.durability == latched != other.durability
    )


def describe_offer(offered: QoSProfile) -> dict[str, Any]:
    """Return an offer with the names of index version 9.

    History and depth are not transmitted between nodes and mostly unknown.
    """
    return {
        "history": offered.history.name.lower(),
        "depth": int(offered.depth),
        "reliability": offered.reliability.name.lower(),
        "durability": offered.durability.name.lower(),
        "deadline": _split_duration(offered.deadline),
        "lifespan": _split_duration(offered.lifespan),
        "liveliness": offered.liveliness.name.lower(),
        "liveliness_lease_duration": _split_duration(offered.liveliness_lease_duration),
        "avoid_ros_namespace_conventions": bool(offered.avoid_ros_namespace_conventions),
    }


def _split_duration(span: Duration) -> dict[str, int]:
    seconds, nanoseconds = divmod(int(span.nanoseconds), 10**9)
    return {"sec": seconds, "nsec": nanoseconds}
