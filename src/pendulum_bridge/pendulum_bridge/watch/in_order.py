"""Samples and commands in the order in which they were said, although they come over topics of their own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

LONGEST_WAIT_NS = 300_000_000  # for a command that says that none is on its way any more
MOST = 2000  # samples that may wait


@dataclass(frozen=True)
class Said:
    """Hold a sample: its stamp and when it was said, ns; positions of cart (m) and pole (rad), NaN for a missing joint."""

    stamp_ns: int
    said_ns: int
    positions: tuple[float, float]


class InOrder:
    """Keep samples back until what was commanded before them has come: until a later command has, or for a while."""

    def __init__(self) -> None:
        self._waiting: deque[Said] = deque(maxlen=MOST)
        self._commanded_ns = 0

    def command(self, said_ns: int) -> None:
        """Note that a command has come, said at this time."""
        self._commanded_ns = said_ns

    def sample(self, said: Said) -> None:
        """Take a sample."""
        self._waiting.append(said)

    def due(self) -> Iterator[Said]:
        """Yield the samples that need not wait any more, in order."""
        while self._waiting:
            first, last = self._waiting[0].said_ns, self._waiting[-1].said_ns
            if not (self._commanded_ns >= first or abs(last - first) > LONGEST_WAIT_NS):
                return
            yield self._waiting.popleft()
