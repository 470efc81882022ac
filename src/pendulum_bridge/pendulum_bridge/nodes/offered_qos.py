"""Qualities of service that publishers offer: what fits them all, and how a bag's index names them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from rclpy.duration import Duration
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy


def choose_qos(offered: Sequence[QoSProfile], depth: int) -> QoSProfile:
    """Return the strictest request that every publisher fulfils: reliable if all are, transient local if all are."""
    reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offered)
    latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offered)
    return QoSProfile(
        depth=depth,
        reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE,
    )


def demands_more(request: QoSProfile, other: QoSProfile) -> bool:
    """Tell whether a request asks for something that the other one does not, so that a publisher may not fulfil it."""
    reliable, latched = ReliabilityPolicy.RELIABLE, DurabilityPolicy.TRANSIENT_LOCAL
    return (request.reliability == reliable != other.reliability) or (
        request.durability == latched != other.durability
    )


def describe_offer(offered: QoSProfile) -> dict[str, Any]:
    """Return an offer by the names of index version 9; history and depth are not told to others and mostly unknown."""
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
