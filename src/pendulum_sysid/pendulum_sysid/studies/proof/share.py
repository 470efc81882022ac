"""A share with its interval."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from scipy.stats import binomtest


@dataclass(frozen=True)
class Share:
    """Hold how many of how many, and the share with its 95 % interval; None for no tries.

    The interval is Wilson's (J. Am. Stat. Assoc. 22 (1927) 209), which stays honest for few tries
    and for none or all.

    hits: how many tries succeeded.
    tries: how many there were.
    """

    hits: int
    tries: int

    @property
    def value(self) -> float | None:
        """The share, 0 to 1."""
        return self.hits / self.tries if self.tries else None

    @property
    def low(self) -> float | None:
        """The lower end of the interval, 0 to 1."""
        return self._compute_interval()[0] if self.tries else None

    @property
    def high(self) -> float | None:
        """The upper end of the interval, 0 to 1."""
        return self._compute_interval()[1] if self.tries else None

    def _compute_interval(self) -> tuple[float, float]:
        interval = binomtest(self.hits, self.tries).proportion_ci(method="wilson")
        return float(interval.low), float(interval.high)

    def make_mapping(self) -> dict[str, float | None]:
        """Return the share as `proof.json` has it."""
        return {
            "hits": self.hits,
            "tries": self.tries,
            "share": self.value,
            "low": self.low,
            "high": self.high,
        }


def count_share(answers: Iterable[bool]) -> Share:
    """Return the share of answers that are true."""
    listed = [bool(answer) for answer in answers]
    return Share(sum(listed), len(listed))
