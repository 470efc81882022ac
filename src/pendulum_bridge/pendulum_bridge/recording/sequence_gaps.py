"""The number of lost messages of a topic, by the numbers that its publishers give them."""

from __future__ import annotations


class SequenceGaps:
    """Count the gaps in a topic's sequence numbers.

    A message does not name its publisher. It is assigned to the publisher whose last number is
    the nearest below its own. With several publishers a gap may be assigned to the wrong
    publisher; the sum is right again when every publisher has sent another message. Losses before
    the first message of a publisher are not counted.
    """

    def __init__(self) -> None:
        self._last: list[int] = []
        self.dropped = 0

    def take(self, number: int, publishers: int) -> None:
        """Count the messages that are missing before a message.

        number: the message's sequence number.
        publishers: number of publishers that the topic has had so far.
        """
        below = [k for k, last in enumerate(self._last) if last < number]
        at = max(below, key=self._last.__getitem__, default=None)
        if at is not None and (self._last[at] + 1 == number or len(self._last) >= publishers):
            self.dropped += number - self._last[at] - 1
            self._last[at] = number
        else:
            self._last.append(number)
