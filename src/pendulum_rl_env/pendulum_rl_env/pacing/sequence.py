"""Check by their stamps that samples come in order and once; they carry no number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import median


@dataclass
class StampSequence:
    """Count what is wrong with a sequence of stamps.

    period_ns: ns; from sample to sample. None while unknown; then no sample counts as lost.
    stale: samples no later than an earlier sample.
    lost: samples that never came, by the gaps between stamps.
    last_ns: ns; the latest stamp.
    """

    period_ns: float | None = None
    stale: int = 0
    lost: int = 0
    last_ns: int | None = None

    def accept(self, stamp_ns: int) -> bool:
        """Tell whether the next stamp is later than the last; count the samples between them."""
        if self.last_ns is not None:
            if stamp_ns <= self.last_ns:
                self.stale += 1
                return False
            if self.period_ns is not None:
                self.lost += max(round((stamp_ns - self.last_ns) / self.period_ns) - 1, 0)
        self.last_ns = stamp_ns
        return True


def compute_period_ns(stamps_ns: Sequence[int]) -> float:
    """Return the period, ns, of two or more rising stamps: the median, for some may be missing."""
    return float(median(after - before for before, after in pairwise(stamps_ns)))
