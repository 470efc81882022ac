"""A share with its interval."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

Z = 1.959964  # of a 95 % interval


@dataclass(frozen=True)
class Share:
    """Hold how many of how many, and the share with its 95 % interval; None of none.

    The interval is Wilson's (J. Am. Stat. Assoc. 22 (1927) 209), which stays honest for few tries
    and for none or all.
    """

    hits: int
    tries: int

    @property
    def value(self) -> float | None:
        """Return the share, 0 to 1."""
        return self.hits / self.tries if self.tries else None

    @property
    def low(self) -> float | None:
        """Return the lower end of the interval."""
        return max(self._middle - self._half, 0.0) if self.tries else None

    @property
    def high(self) -> float | None:
        """Return the upper end of the interval."""
        return min(self._middle + self._half, 1.0) if self.tries else None

    @property
    def _middle(self) -> float:
        return (self.hits + Z**2 / 2) / (self.tries + Z**2)

    @property
    def _half(self) -> float:
        spread = self.hits * (self.tries - self.hits) / self.tries + Z**2 / 4
        return Z * math.sqrt(spread) / (self.tries + Z**2)

    def to_mapping(self) -> dict:
        """Return the share as the proof's JSON holds it."""
        return {
            "hits": self.hits,
            "tries": self.tries,
            "share": self.value,
            "low": self.low,
            "high": self.high,
        }


def count_share(answers: Iterable[bool]) -> Share:
    """Return how many of the answers are yes."""
    listed = [bool(one) for one in answers]
    return Share(sum(listed), len(listed))
