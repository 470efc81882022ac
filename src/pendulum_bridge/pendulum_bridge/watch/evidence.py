"""Evidence that something has changed, gathered window by window, with a stated rate of false alarms.

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

KEPT = 120  # windows in which a change may have begun: 30 s
SHARE = 0.5  # windows overlap by half: each sample speaks twice, each time with half its weight
LARGER = (
    4.0  # times what is worth an alarm: deviation of the sizes beyond it that are averaged over
)
AT_MOST = 0.25  # of the alarm's threshold, that a single window may add: a knock on the rig is no change of it


@dataclass(frozen=True)
class Leader:
    """Hold how one signature stands.

    ratio: its log-likelihood ratio. since: how many windows ago it began. size, deviation: of the
    change, in its unit.
    """

    ratio: float
    since: int
    size: float
    deviation: float


class Evidence:
    """Gather scores of a bank of signatures.

    worth: (signatures,) changes worth an alarm, above 0. falls: (signatures,) whether a change may
    be negative too.
    threshold: the log-likelihood ratio of an alarm.
    """

    def __init__(self, worth: Floats, falls: Floats, threshold: float) -> None:
        self._worth, self._falls = worth, falls.astype(bool)
        self._most = AT_MOST * threshold
        self.clear()

    def clear(self) -> None:
        """Forget everything."""
        self._scores = np.zeros((0, len(self._worth)))
        self._information = np.zeros((0, len(self._worth)))

    def add(self, score: Floats, information: Floats) -> None:
        """Take a window's scores and information, (signatures,) each."""
        best = float(np.max(score**2 / np.maximum(information, 1e-300), initial=0.0)) / 2
        weight = SHARE * min(1.0, self._most / max(SHARE * best, 1e-300))
        self._scores = np.concatenate([self._scores[-KEPT + 1 :], weight * score[None]])
        self._information = np.concatenate(
            [self._information[-KEPT + 1 :], weight * information[None]]
        )

    def leaders(self) -> list[Leader]:
        """Return how each signature stands now."""
        total = np.cumsum(self._scores[::-1], axis=0)
        known = np.cumsum(self._information[::-1], axis=0)
        both = [ratios(way * total, known, self._worth) for way in (1.0, -1.0)]
        both[1][:, ~self._falls] = -math.inf
        larger = np.maximum(*both)
        rows = np.argmax(larger, axis=0)
        return [self._leader(k, int(row), larger, total, known) for k, row in enumerate(rows)]

    def _leader(self, k: int, row: int, ratio: Floats, total: Floats, known: Floats) -> Leader:
        information = max(float(known[row, k]), 1e-300)
        return Leader(
            float(ratio[row, k]), row, float(total[row, k]) / information, information**-0.5
        )


def ratios(score: Floats, information: Floats, worth: Floats) -> Floats:
    """Return log-likelihood ratios of a positive change beyond worth against one of just worth; see the module."""
    variance = (LARGER * worth) ** 2
    beyond = score - worth * information
    ratio = 0.5 * (
        variance * beyond**2 / (1 + variance * information) - np.log1p(variance * information)
    )
    return np.where(beyond > 0, ratio, -np.inf)


def threshold(tests: int, hours: float, hop_s: float) -> float:
    """Return the log-likelihood ratio at which so many tests together give a false alarm once in so many hours, at most."""
    return math.log(max(tests, 1) * max(hours * 3600 / hop_s, 1.0))
