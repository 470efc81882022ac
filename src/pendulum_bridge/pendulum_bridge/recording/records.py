"""The nouns of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Topic:
    """Hold what a bag says of a topic.

    type: as in "std_msgs/msg/Float64". definition: the type's text and that of all types in it
    (ros2msg), "" when unknown.
    type_hash: "RIHS01_...", "" when unknown. offered_qos: one mapping a publisher, by the names of
    the index.
    """

    name: str
    type: str
    definition: str
    type_hash: str = ""
    offered_qos: tuple[Mapping[str, Any], ...] = ()


class Message(NamedTuple):
    """Hold one message as it came over the wire.

    received_ns, published_ns: since the epoch. sequence: its number among its publisher's
    messages, 0 when unknown.
    data: serialised (CDR).
    """

    topic: str
    received_ns: int
    published_ns: int
    sequence: int
    data: bytes


@dataclass
class Tally:
    """Count what stands in a data file: messages by topic, and the receive times (ns) of the earliest and the latest."""

    messages: dict[str, int] = field(default_factory=dict)
    first_ns: int | None = None
    last_ns: int | None = None

    @property
    def total(self) -> int:
        """Return how many messages there are."""
        return sum(self.messages.values())

    @property
    def duration_ns(self) -> int:
        """Return the time between the earliest and the latest message, ns."""
        return 0 if self.first_ns is None or self.last_ns is None else self.last_ns - self.first_ns

    def add(self, message: Message) -> None:
        """Count a message."""
        received = message.received_ns
        self.messages[message.topic] = self.messages.get(message.topic, 0) + 1
        self.first_ns = received if self.first_ns is None else min(self.first_ns, received)
        self.last_ns = received if self.last_ns is None else max(self.last_ns, received)
