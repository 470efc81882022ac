"""The nouns of a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple


@dataclass(frozen=True)
class Topic:
    """Describe a topic of a bag.

    name: with its namespace.
    type: such as "std_msgs/msg/Float64".
    definition: text of the type and of all types in it (ros2msg); "" when unknown.
    type_hash: "RIHS01_..."; "" when unknown.
    offered_qos: a mapping for each publisher, by the names of the index.
    """

    name: str
    type: str
    definition: str
    type_hash: str = ""
    offered_qos: tuple[Mapping[str, Any], ...] = ()


class Message(NamedTuple):
    """Hold a message as it was received.

    topic: name of its topic.
    received_ns, published_ns: since the epoch.
    sequence: number among the publisher's messages, from 1; 0 when unknown.
    data: serialised (CDR).
    """

    topic: str
    received_ns: int
    published_ns: int
    sequence: int
    data: bytes


@dataclass
class Tally:
    """Count the messages of a data file.

    messages: topic -> number of messages.
    first_ns, last_ns: receive times of the earliest and the latest; None without messages.
    """

    messages: dict[str, int] = field(default_factory=dict)
    first_ns: int | None = None
    last_ns: int | None = None

    @property
    def total(self) -> int:
        """Return the number of messages."""
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
