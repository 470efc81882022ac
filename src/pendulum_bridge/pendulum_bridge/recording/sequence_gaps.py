"""How many messages of a topic never arrived, by the numbers that publishers give them."""

from __future__ import annotations


class SequenceGaps:
    """Count the gaps in one topic's sequence numbers.

    A message does not say who sent it. So each is taken for the next of the publisher whose last
    number is nearest below its own. With several publishers a gap may so be given to the wrong
    one; the sum is right again as soon as each has been heard once more. What was lost before a
    publisher's first message that arrived is not counted.
    """

    def __init__(self) -> None:
        self._last: list[int] = []
        self.dropped = 0

    def take(self, number: int, publishers: int) -> None:
        """Count what is missing before a message; publishers: how many have been seen so far on the topic."""
        below = [k for k, last in enumerate(self._last) if last < number]
        at = max(below, key=self._last.__getitem__, default=None)
        if at is not None and (self._last[at] + 1 == number or len(self._last) >= publishers):
            self.dropped += number - self._last[at] - 1
            self._last[at] = number
        else:
            self._last.append(number)
