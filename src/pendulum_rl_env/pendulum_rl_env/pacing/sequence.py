"""Whether samples come in order, each once: by their stamps, for they carry no number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median


@dataclass
class StampSequence:
    """Count what is wrong with a row of stamps.

    period_ns: from sample to sample; None while it is not known, then nothing counts as lost.
    stale: samples no later than one that came before. lost: samples that never came, by the gaps
    between stamps.
    """

    period_ns: float | None = None
    stale: int = 0
    lost: int = 0
    last_ns: int | None = None

    def follows(self, stamp_ns: int) -> bool:
        """Take the next stamp and tell whether it is later than the last one; count what is missing between them."""
        if self.last_ns is not None:
            if stamp_ns <= self.last_ns:
                self.stale += 1
                return False
            if self.period_ns is not None:
                self.lost += max(round((stamp_ns - self.last_ns) / self.period_ns) - 1, 0)
        self.last_ns = stamp_ns
        return True


def compute_period_ns(stamps_ns: Sequence[int]) -> float:
    """Return the period, ns, of rising stamps, at least two: the median, for a few may be missing."""
    return float(median(after - before for before, after in pairwise(stamps_ns)))
