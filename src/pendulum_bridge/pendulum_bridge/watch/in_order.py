"""Put samples and commands into the order in which they were published, on topics of their own."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

LONGEST_WAIT_NS = 300_000_000  # for a later command
MOST_WAITING = 2000  # samples that may wait


@dataclass(frozen=True)
class Said:
    """Hold a sample.

    stamp_ns: ns; sampling time.
    said_ns: ns; when it was published.
    positions: cart (m) and pole (rad), NaN for a missing joint.
    """

    stamp_ns: int
    said_ns: int
    positions: tuple[float, float]


class InOrder:
    """Hold samples back until all commands before them have come.

    They wait until a later command has come, or for a while.
    """

    def __init__(self) -> None:
        self._waiting: deque[Said] = deque(maxlen=MOST_WAITING)
        self._commanded_ns = 0

    def command(self, said_ns: int) -> None:
        """Note that a command has come, published at said_ns."""
        self._commanded_ns = said_ns

    def sample(self, said: Said) -> None:
        """Take a sample."""
        self._waiting.append(said)

    def due(self) -> Iterator[Said]:
        """Yield the samples that need not wait any more, in order."""
        while self._waiting:
            first_ns, last_ns = self._waiting[0].said_ns, self._waiting[-1].said_ns
            waited_ns = abs(last_ns - first_ns)
            if self._commanded_ns < first_ns and waited_ns <= LONGEST_WAIT_NS:
                return
            yield self._waiting.popleft()
