"""Gather evidence of a change window by window, with a stated rate of false alarms.

For every signature and every moment in the last minute the watch asks how much better the windows
since then are explained by a change of that kind. A change counts when it exceeds what is worth an
alarm (`worth`): the likelihood is compared with that of a change of just that size, and averaged
over half a normal distribution of larger ones. Under the twin as it is, and under any smaller
change, such a ratio has a mean of at most 1, so that it exceeds A with a probability of at most
1/A from any one moment on (Ville's inequality), and the mean time to a false alarm of a test that
starts anew at every window is at least A windows (Lorden, Annals of Mathematical Statistics 42
(1971) 1897, theorem 2;
limited to the last windows: Lai, IEEE Transactions on Information Theory 44 (1998) 2917; for such
banks: Basseville and Nikiforov, Detection of Abrupt Changes, 1993, chapter 5). The bank's alarms
add up, so A is the number of tests times the windows in the time asked for.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats

KEPT_WINDOWS = 120  # windows in which a change may have begun: 30 s
OVERLAP_WEIGHT = 0.5  # windows overlap by half: each sample counts twice
LARGER_SIZES = 4.0  # in units of worth: deviation of the larger sizes that are averaged over
MOST_SHARE_A_WINDOW = 0.25  # of the threshold: a knock on the rig is no change of it


@dataclass(frozen=True)
class Leader:
    """Hold how a signature stands.

    ratio: log-likelihood ratio.
    since: how many windows ago the change began.
    size, deviation: in the signature's unit; the change and its standard deviation.
    """

    ratio: float
    since: int
    size: float
    deviation: float


class Evidence:
    """Gather scores of a bank of signatures.

    worth: (signatures,) above 0; sizes worth an alarm.
    falls: (signatures,) whether a change may be negative, too.
    threshold: log-likelihood ratio of an alarm.
    """

    def __init__(self, worth: Floats, falls: Floats, threshold: float) -> None:
        self._worth, self._falls = worth, falls.astype(bool)
        self._most = MOST_SHARE_A_WINDOW * threshold
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._scores = np.zeros((0, len(self._worth)))
        self._information = np.zeros((0, len(self._worth)))

    def add(self, score: Floats, information: Floats) -> None:
        """Take a window's score and information, (signatures,) each."""
        best = float(np.max(score**2 / np.maximum(information, 1e-300), initial=0.0)) / 2
        weight = OVERLAP_WEIGHT * min(1.0, self._most / max(OVERLAP_WEIGHT * best, 1e-300))
        self._scores = np.concatenate([self._scores[-KEPT_WINDOWS + 1 :], weight * score[None]])
        self._information = np.concatenate(
            [self._information[-KEPT_WINDOWS + 1 :], weight * information[None]]
        )

    def leaders(self) -> list[Leader]:
        """Return how each signature stands now."""
        total = np.cumsum(self._scores[::-1], axis=0)
        information = np.cumsum(self._information[::-1], axis=0)
        rising, falling = (
            compute_ratios(way * total, information, self._worth) for way in (1.0, -1.0)
        )
        falling[:, ~self._falls] = -math.inf
        ratio = np.maximum(rising, falling)
        rows = np.argmax(ratio, axis=0)
        return [
            _make_leader(int(row), float(ratio[row, k]), total[row, k], information[row, k])
            for k, row in enumerate(rows)
        ]


def _make_leader(since: int, ratio: float, score: float, information: float) -> Leader:
    known = max(float(information), 1e-300)
    return Leader(ratio, since, float(score) / known, known**-0.5)


def compute_ratios(score: Floats, information: Floats, worth: Floats) -> Floats:
    """Return log-likelihood ratios of a positive change beyond worth against just worth.

    score, information: (windows, signatures) summed since each window.
    worth: (signatures,) sizes worth an alarm.
    Source: see the module.
    """
    variance = (LARGER_SIZES * worth) ** 2
    beyond = score - worth * information
    ratio = 0.5 * (
        variance * beyond**2 / (1 + variance * information) - np.log1p(variance * information)
    )
    return np.where(beyond > 0, ratio, -np.inf)


def compute_threshold(tests: int, hours: float, hop_s: float) -> float:
    """Return the log-likelihood ratio of an alarm.

    tests: how many run together.
    hours: h; mean time between false alarms, at least.
    hop_s: s; from window to window.
    """
    return math.log(max(tests, 1) * max(hours * 3600 / hop_s, 1.0))
