"""What one data file of a bag holds, whichever storage it has."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from pendulum_sysid.errors import FileError, UnusableRecording, WrongUse
from pendulum_sysid.reading.raw import suggest_more
from pendulum_sysid.reading.unpacking import MOST_MESSAGE_BYTES

MOST_KEPT_BYTES = 1 << 30  # 7 million joint states: two hours at 1 kHz

MOST_SUGGESTED = 4  # topics


@dataclass
class Contents:
    """Collect the messages of the wanted topics, and what the file says of itself.

    wanted: topics whose messages are kept.
    types: topic -> message type, for all topics.
    messages: wanted topic -> (time in ns, serialised message), in the order of the file. The time
        is that of receiving, without delays where the file tells them.
    counted: topic -> number of messages by the file's own index; empty when it has none.
    whole: False when the file ends before its end mark or a part of it is damaged.
    damaged_parts: chunks and records whose bytes are damaged, and which are left out.
    kept_bytes: size of all messages that are kept.
    """

    wanted: Collection[str]
    types: dict[str, str] = field(default_factory=dict)
    messages: dict[str, list[tuple[int, bytes]]] = field(default_factory=dict)
    counted: dict[str, int] = field(default_factory=dict)
    whole: bool = True
    damaged_parts: int = 0
    kept_bytes: int = 0

    def add(self, topic: str, time_ns: int, data: bytes) -> bool:
        """Keep a message if its topic is wanted and it is not huge; return whether it is kept."""
        if topic not in self.wanted or len(data) > MOST_MESSAGE_BYTES:
            return False
        self.kept_bytes += len(data)
        if self.kept_bytes > MOST_KEPT_BYTES:
            raise FileError(
                f"expected at most {MOST_KEPT_BYTES >> 30} GiB of messages on the two topics, "
                "found more: cut the recording into parts"
            )
        self.messages.setdefault(topic, []).append((time_ns, data))
        return True

    def absorb(self, other: Contents) -> None:
        """Append what a later file of the same bag holds."""
        self.types |= other.types
        for topic, messages in other.messages.items():
            self.messages.setdefault(topic, []).extend(messages)
        for topic, count in other.counted.items():
            self.counted[topic] = self.counted.get(topic, 0) + count
        self.whole = self.whole and other.whole
        self.damaged_parts += other.damaged_parts

    def of(self, topic: str, kind: str, option: str, needed: bool) -> list[tuple[int, bytes]]:
        """Return a topic's messages.

        option: the command-line option that names another topic.

        Raises WrongUse when the topic is missing, of another type than kind or, if it is
        needed, empty.
        """
        if topic not in self.types:
            there = ", ".join(sorted(self.types)) or "no topics at all"
            raise WrongUse(
                f"expected the topic {topic}, found {there}: "
                f"{self._suggest_topic(topic, kind, option)}"
            )
        if self.types[topic] != kind:
            raise WrongUse(
                f"expected {kind} on {topic}, found {self.types[topic]}: "
                f"{self._suggest_topic(topic, kind, option)}"
            )
        messages = self.messages.get(topic, [])
        if not messages and needed:
            raise UnusableRecording(
                f"expected messages on {topic}, found none"
                f"{suggest_more(not self.whole, 'record again')}, or "
                f"{self._suggest_topic(topic, kind, option)}"
            )
        return messages

    def _suggest_topic(self, topic: str, kind: str, option: str) -> str:
        """Return what to do where a topic does not serve: which others hold such messages."""
        others = [
            other
            for other, its_kind in sorted(self.types.items())
            if its_kind == kind and other != topic and self.counted.get(other, 1)
        ]
        if not others:
            return f"record again, for no other topic holds {kind}"
        more = "" if len(others) <= MOST_SUGGESTED else " or another of these messages"
        return f"give {option} {' or '.join(others[:MOST_SUGGESTED])}{more}"
