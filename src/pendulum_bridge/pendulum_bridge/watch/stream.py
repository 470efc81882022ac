"""Put samples and commands on one even clock, and keep them as long as they are needed."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_twin.arrays import Floats

PHASE_GAIN = 0.02  # of a stamp's error, by which the clock's phase follows it
RATE_TOLERANCE = 0.01  # share by which the rate may be off while the watch can still judge
FOLLOWED_RATE_TOLERANCE = 0.25  # share beyond which the clock no longer follows the samples
RATE_SAMPLES = 100  # from which the rate is judged
SLOT_TOLERANCE = 0.6  # of a period, by which a stamp may be off its slot
LONGEST_GAP_S = 0.1  # a longer silence begins anew: what the rig did meanwhile is not known
ANSWER_SHARE = 0.75  # of a period after a sample; later commands answer the next sample
TELEPORT_M, TELEPORT_RAD = 0.02, 0.1  # both joints jumping so far at once is a reset, no slip
HANGING = (0.0, math.pi)  # where a twin's reset puts cart and pole
FULL_TURN = 2 * math.pi


@dataclass(frozen=True)
class History:
    """Hold the last slots of the even clock, the oldest first.

    slot: number of the last slot.
    end_ns: ns; stamp of its sample.
    command: (n,) held from each slot to the next.
    positions: (n, 2) of cart (m) and pole (rad), NaN where a sample was lost or a joint is
        missing.
    """

    slot: int
    end_ns: int
    command: Floats
    positions: Floats


class Stream:
    """Sort samples and commands into slots, one a period, and keep the last of them.

    The rig samples evenly, and stamps scatter around that: a sample belongs to the slot nearest to
    its stamp, on a clock that follows the stamps slowly. A command belongs to the last sample that
    was published before it, for the period that follows, and is held until the next command. A
    command that comes when the next sample is all but due belongs to that sample, for it acts at
    once. A twin publishes what it has applied when the period has passed.

    period_s: s; from slot to slot.
    slots: how many are kept.
    answers: share of a period in which a command answers a sample; 1 for a twin.
    samples: taken in order.
    lost: samples that never came.
    late: samples older than their slot.
    begun: how often the clock began anew.
    """

    def __init__(self, period_s: float, slots: int, answers: float = ANSWER_SHARE) -> None:
        self._period_s, self._answers = period_s, answers
        self._command: deque[float] = deque(maxlen=slots)
        self._positions: deque[tuple[float, float]] = deque(maxlen=slots)
        self._pending: deque[tuple[int, float]] = deque(maxlen=slots)
        self.samples = self.lost = self.late = self.begun = 0
        self._turns = self._held = 0.0
        self._slot = self._first = -1
        self._here = self._stamp_ns = self._first_ns = 0

    def command(self, value: float, said_ns: int) -> None:
        """Take a command, published at said_ns on the clock on which samples are published."""
        if not math.isfinite(value):
            return
        if self._pending and said_ns < self._pending[-1][0]:  # the clock was set back
            self._held = self._pending[-1][1]
            self._pending.clear()
        self._pending.append((said_ns, value))

    def sample(self, stamp_ns: int, said_ns: int, positions: Sequence[float]) -> bool:
        """Take a sample and return whether a slot was added.

        stamp_ns: ns; sampling time.
        said_ns: ns; when it was published.
        positions: cart (m) and pole (rad), NaN for a missing joint.
        """
        if self._slot < 0 or not self._is_next(stamp_ns):
            self._begin(stamp_ns, said_ns, positions)
            return True
        at = self._origin + (stamp_ns - self._origin_ns) * 1e-9 / self._period_s
        ahead = at - self._slot
        if ahead < 1 - SLOT_TOLERANCE:
            self.late += 1
            self._here += 1
            return False
        slot = self._slot + (1 if ahead < 1 + SLOT_TOLERANCE else round(ahead))
        self._origin -= PHASE_GAIN * (at - slot)
        here = self._unwrap(positions)
        if slot == self._slot + 1 and self._has_teleported(here):
            self._begin(stamp_ns, said_ns, positions)
            return True
        self.lost += slot - self._slot - 1
        for missing in range(slot - self._slot - 1, -1, -1):
            self._settle(said_ns - round(missing * self._period_s * 1e9))
            if missing:
                self._positions.append((math.nan, math.nan))
                self._command.append(self._held)
        self._add(slot, stamp_ns, here)
        return True

    @property
    def length(self) -> int:
        """Return how many slots are kept since the clock began anew."""
        return len(self._positions)

    @property
    def slot(self) -> int:
        """Return the number of the last slot."""
        return self._slot

    @property
    def stamp_ns(self) -> int:
        """Return the stamp of the last sample that was taken."""
        return self._stamp_ns

    @property
    def rate_hz(self) -> float | None:
        """Return the rate of the samples, Hz; None while there are too few.

        It is counted when it is far from the even clock's; else it is that of the clock, which a
        few lost samples do not change.
        """
        counted, seconds = self._here - 1, (self._stamp_ns - self._first_ns) * 1e-9
        if counted < RATE_SAMPLES or seconds <= 0:
            return None
        if abs(counted / seconds * self._period_s - 1) > FOLLOWED_RATE_TOLERANCE:
            return counted / seconds
        return (self._slot - self._first) / seconds

    def history(self, upto: int) -> History:
        """Return the slots up to a slot that is still kept.

        The last slot's command is what is held so far.
        """
        beyond = self._slot - upto
        command = np.array(self._command)[: self.length - beyond]
        end_ns = self._stamp_ns - round(beyond * self._period_s * 1e9)
        return History(upto, end_ns, command, np.array(self._positions)[: self.length - beyond])

    def _is_next(self, stamp_ns: int) -> bool:
        return (
            -LONGEST_GAP_S < (stamp_ns - self._stamp_ns) * 1e-9 <= LONGEST_GAP_S + self._period_s
        )

    def _begin(self, stamp_ns: int, said_ns: int, positions: Sequence[float]) -> None:
        self._positions.clear()
        self._command.clear()
        self._settle(said_ns)
        self._origin_ns, self._first_ns = stamp_ns, stamp_ns
        self._turns, self._here = 0.0, 0
        self.begun += 1
        slot = self._first = self._slot + 1
        self._origin = float(slot)
        self._add(slot, stamp_ns, (positions[0], positions[1]))

    def _add(self, slot: int, stamp_ns: int, here: tuple[float, float]) -> None:
        self.samples += 1
        self._here += 1
        self._slot, self._stamp_ns, self._last = slot, stamp_ns, here
        self._positions.append(here)
        self._command.append(self._held)  # until it is settled

    def _settle(self, said_ns: int) -> None:
        """Give the last slot the last command that was not too close before this sample."""
        due_ns = said_ns - (1 - self._answers) * self._period_s * 1e9
        while self._pending and self._pending[0][0] <= due_ns:
            self._held = self._pending.popleft()[1]
        if self._command:
            self._command[-1] = self._held

    def _unwrap(self, positions: Sequence[float]) -> tuple[float, float]:
        """Return the positions with the pole moved by whole turns to where it was last."""
        cart, pole = positions[0], positions[1] + self._turns
        if abs(pole - self._last[1]) > math.pi:
            turns = round((self._last[1] - pole) / FULL_TURN) * FULL_TURN
            self._turns += turns
            pole += turns
        return cart, pole

    def _has_teleported(self, here: tuple[float, float]) -> bool:
        """Tell whether the rig was reset.

        Both joints have jumped off the line through their last two samples, or one of them has to
        where a reset puts it.
        """
        if len(self._positions) < 2:
            return False
        (x0, th0), (x1, th1) = self._positions[-2], self._positions[-1]
        off_m, off_rad = abs(here[0] - 2 * x1 + x0), abs(here[1] - 2 * th1 + th0)
        jumped = off_m > TELEPORT_M, off_rad > TELEPORT_RAD
        return all(jumped) or (any(jumped) and here == HANGING)


def make_still_history(slots: int) -> History:
    """Return a history of so many slots of a rig that hangs at rest."""
    return History(slots - 1, 0, np.zeros(slots), np.tile([0.0, math.pi], (slots, 1)))
