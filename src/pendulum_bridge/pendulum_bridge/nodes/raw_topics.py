"""Topics as bytes: discovered in the graph, subscribed as offered, and read without an executor.

An executor would wake up for every message. The middleware queues messages and notes when each
arrived, so it is enough to read a few dozen times a second, at a few microseconds a message.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from typing import Any

from rclpy.node import Node
from rclpy.subscription import Subscription
from rclpy.topic_endpoint_info import TopicEndpointInfo

from pendulum_bridge.nodes.offered_qos import choose_qos, demands_more, describe_offer
from pendulum_bridge.recording.definition import find_definition
from pendulum_bridge.recording.received_clock import ReceivedClock
from pendulum_bridge.recording.sequence_gaps import SequenceGaps
from pendulum_twin.bags.records import Message, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.direct import UntouchedGroup
from pendulum_twin.topics import CLOCK

QUEUE = 5000  # messages a topic; the middleware keeps no more
# how long a subscription is read beside that which replaces it: discovery takes as long, rarely
TAKEOVER_S = 2.0


@dataclass
class _Listened:
    """Hold a topic: its subscription as soon as its type is known, and its publishers so far.

    name: resolved name.
    subscription: None before the topic is published.
    publishers: identifiers of the publishers.
    gaps: counts messages that never came.
    useless: whether the topic's type is not installed.
    replaced: subscriptions that are being replaced, and when they were, s, monotonic.
    taken: numbers and times of the messages since the first of these was replaced.
    """

    name: str
    subscription: Subscription | None = None
    publishers: set[bytes] = field(default_factory=set)
    gaps: SequenceGaps = field(default_factory=SequenceGaps)
    useless: bool = False
    replaced: list[tuple[Subscription, float]] = field(default_factory=list)
    taken: set[tuple[int, int]] = field(default_factory=set)

    @property
    def subscriptions(self) -> list[Subscription]:
        """The subscriptions to read, the oldest first."""
        latest = [] if self.subscription is None else [self.subscription]
        return [*(subscription for subscription, _ in self.replaced), *latest]


class RawTopics:
    """Listen to topics by name; raise BadInputError for an invalid name.

    With use_sim_time, messages carry the simulated time of their arrival, and messages before the
    first `/clock` message are left out.
    """

    def __init__(self, node: Node, names: Sequence[str]) -> None:
        self._node, self._group = node, UntouchedGroup()
        self._heard = [
            _Listened(name) for name in dict.fromkeys(_resolve_name(node, name) for name in names)
        ]
        simulated = bool(node.get_parameter("use_sim_time").value)
        self._clock_topic = _Listened(CLOCK) if simulated else None
        self._clock = ReceivedClock()

    @property
    def waiting(self) -> list[str]:
        """The topics that nobody publishes so far."""
        return [heard.name for heard in self._heard if heard.subscription is None]

    @property
    def dropped(self) -> dict[str, int]:
        """The number of messages of each topic that were published and never came."""
        return {
            heard.name: heard.gaps.dropped
            for heard in self._heard
            if heard.subscription is not None
        }

    def discover(self) -> list[Topic]:
        """Subscribe the topics that are published by now, and return the new ones.

        A request that a new publisher does not fulfil is relaxed.
        """
        if self._clock_topic is not None:
            self._look_for(self._clock_topic)
        topics = [self._look_for(heard) for heard in self._heard if not heard.useless]
        return [topic for topic in topics if topic is not None]

    def drain(self) -> list[Message]:
        """Return the messages since the last call."""
        messages = [message for heard in self._heard for message in _take_queued(heard)]
        if self._clock_topic is None:
            return messages
        for tick in _take_queued(self._clock_topic):
            self._clock.take(tick.received_ns, tick.data)
        timed = [(self._clock.convert(message.received_ns), message) for message in messages]
        self._clock.forget_before_last()
        return [
            message._replace(received_ns=time_ns)
            for time_ns, message in timed
            if time_ns is not None
        ]

    def _look_for(self, heard: _Listened) -> Topic | None:
        self._end_replaced(heard)
        publishers = self._node.get_publishers_info_by_topic(heard.name)
        if not publishers:
            return None
        heard.publishers |= {bytes(publisher.endpoint_gid) for publisher in publishers}
        request = choose_qos([publisher.qos_profile for publisher in publishers], QUEUE)
        if heard.subscription is None:
            return self._subscribe(heard, publishers, request)
        if demands_more(heard.subscription.qos_profile, request):
            # the subscription is read on until the publishers surely send to the next one
            heard.replaced.append((heard.subscription, time.monotonic()))
            kind = heard.subscription.msg_type
            heard.subscription = self._create_subscription(kind, heard.name, request)
        return None

    def _end_replaced(self, heard: _Listened) -> None:
        """Destroy replaced subscriptions, all at once, when the next one has long taken over."""
        if heard.subscription is None or not heard.replaced:
            return
        publishers = max(former.get_publisher_count() for former, _ in heard.replaced)
        is_known = heard.subscription.get_publisher_count() >= publishers
        if is_known and time.monotonic() - heard.replaced[-1][1] > TAKEOVER_S:
            for former, _ in heard.replaced:
                self._node.destroy_subscription(former)
            heard.replaced.clear()

    def _subscribe(
        self, heard: _Listened, publishers: Sequence[TopicEndpointInfo], request: Any
    ) -> Topic | None:
        type_name = publishers[0].topic_type
        try:
            kind = _import_message_class(type_name)
            heard.subscription = self._create_subscription(kind, heard.name, request)
        except (ImportError, AttributeError, ValueError) as error:
            heard.useless = True
            self._node.get_logger().error(
                f"{heard.name} is not recorded: {type_name} is not installed ({error})"
            )
            return None
        type_hash = str(publishers[0].topic_type_hash)
        return Topic(
            name=heard.name,
            type=type_name,
            definition=find_definition(type_name),
            type_hash="" if type_hash == "INVALID" else type_hash,
            offered_qos=tuple(describe_offer(publisher.qos_profile) for publisher in publishers),
        )

    def _create_subscription(self, kind: Any, name: str, request: Any) -> Subscription:
        return self._node.create_subscription(
            kind, name, _ignore, request, callback_group=self._group, raw=True
        )


def _ignore(message: bytes) -> None:
    """Be the callback that `UntouchedGroup` never runs."""


def _take_queued(heard: _Listened) -> Iterator[Message]:
    """Yield queued messages, each once though several subscriptions have it."""
    for subscription in heard.subscriptions:
        for message in _take_from(heard, subscription):
            key = (message.sequence, message.published_ns)
            if key in heard.taken:
                continue
            if heard.replaced:
                heard.taken.add(key)
            if message.sequence:
                heard.gaps.take(message.sequence, len(heard.publishers))
            yield message


def _take_from(heard: _Listened, subscription: Subscription) -> Iterator[Message]:
    """Yield the queued messages of a subscription, at most a queue's length: a flood ends."""
    handle = subscription.handle
    with handle:
        for _ in range(QUEUE):
            taken = handle.take_message(subscription.msg_type, True)
            if taken is None:
                return
            data, info = taken
            received_ns = info["received_timestamp"] or time.time_ns()
            number = info["publication_sequence_number"] or 0
            yield Message(
                heard.name, received_ns, info["source_timestamp"] or received_ns, number, data
            )


def _resolve_name(node: Node, name: str) -> str:
    try:
        return str(node.resolve_topic_name(name))
    except (RuntimeError, ValueError) as error:
        reason = str(error).splitlines()[0].split(", at ")[0]
        raise BadInputError(
            f"topics: expected names of topics, found {name!r} ({reason})"
        ) from error


def _import_message_class(type_name: str) -> type:
    package, kind, name = type_name.split("/")
    return getattr(import_module(f"{package}.{kind}"), name)
