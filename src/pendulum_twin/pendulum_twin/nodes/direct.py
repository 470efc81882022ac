"""Wait on a subscription and take its messages directly, without an executor in the loop.

An executor spends more time on each message than the middleware. For a user who has nothing to do
until the next message, waiting on the subscription alone is several times faster. The node's other
callbacks need an executor in a thread of their own, which leaves these subscriptions alone.
"""

from __future__ import annotations

import time
from typing import Any

from rclpy.callback_groups import CallbackGroup
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.impl.implementation_singleton import rclpy_implementation as rcl
from rclpy.node import Node
from rclpy.qos import QoSProfile


class UntouchedGroup(CallbackGroup):
    """Keep executors from waiting for the entities of this group, and from reading them."""

    def can_execute(self, entity: Any) -> bool:
        """Refuse."""
        return False

    def beginning_execution(self, entity: Any) -> bool:
        """Refuse."""
        return False

    def ending_execution(self, entity: Any) -> None:
        """Do nothing."""


# An executor that waits for a subscription's events is woken by each of its messages, too. So
# nothing here reports a publisher with another quality of service; that publisher reports it.
_NO_EVENTS = SubscriptionEventCallbacks(use_default_callbacks=False)


class DirectSubscription:
    """Subscribe a node to a topic and take its messages in order; one thread at a time."""

    def __init__(self, node: Node, kind: type[Any], topic: str, qos: QoSProfile) -> None:
        self._subscription = node.create_subscription(
            kind,
            topic,
            lambda message: None,
            qos,
            callback_group=UntouchedGroup(),
            event_callbacks=_NO_EVENTS,
        )
        self._handle = self._subscription.handle
        self._kind = kind
        self._context = node.context
        self._waiting = rcl.WaitSet(1, 0, 0, 0, 0, 0, node.context.handle)

    def take(self) -> Any | None:
        """Return the oldest message that was not taken yet; None when there is none."""
        answer = self._handle.take_message(self._kind, False)
        return None if answer is None else answer[0]

    def pause(self, timeout_s: float) -> None:
        """Wait until a message can be taken, or timeout_s; it may end early for no reason."""
        if not self._context.ok():
            return
        with self._handle:
            self._waiting.clear_entities()
            self._waiting.add_subscription(self._handle)
            self._waiting.wait(max(round(timeout_s * 1e9), 0))

    def wait(self, timeout_s: float) -> Any | None:
        """Return the next message; None when there is none within timeout_s."""
        end = time.monotonic() + timeout_s
        while (message := self.take()) is None:
            left_s = end - time.monotonic()
            if left_s <= 0 or not self._context.ok():
                return None
            self.pause(left_s)
        return message

    def clear(self) -> int:
        """Throw away all messages that were not taken; return how many there were."""
        count = 0
        while self.take() is not None:
            count += 1
        return count

    @property
    def publishers(self) -> int:
        """Return how many publishers are known."""
        return int(self._subscription.get_publisher_count())
