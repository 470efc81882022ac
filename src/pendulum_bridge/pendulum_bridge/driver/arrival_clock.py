"""Sampling times of evenly spaced samples, estimated from arrivals with varying delays.

A delay-locked loop (F. Adriaensen, Using a DLL to filter time, 2005) follows the mean arrival with
an even grid; its gains fall from those of a straight line fitted to all packets so far to those of
a fixed memory. As no packet comes before it is sent, sampling times lie as far before the grid as
early packets come. A packet that is off the grid by more than the tolerance is treated so:

- Late by one to three whole periods: as many samples were lost; the grid skips them.
- Late by another time: the packet was held up. It gets the next time of the grid, and so does each
  packet of the burst that follows. When the next packets are as late, the grid itself has moved
  (the sender stood still, or much was lost), and follows.
- Early by whole periods: samples that had counted as lost had only been held up; the grid goes
  back.
- Off by more than a second: the system's clock was set, or the sender was away; a new grid begins.

Times always rise, by at least a quarter of a period, with an exception: when the clock was set
back by more than a second they go back once with it, as every other node then lives in that time.
"""

from __future__ import annotations

from dataclasses import dataclass

RESTART_S = 1.0  # distance from the grid beyond which a new grid begins
# largest deviation that the loop follows, in periods: usually, and while it learns the period
TOLERANCE_PERIODS, FIRST_TOLERANCE_PERIODS = 0.125, 0.3
MOST_LOST = 3  # periods by which one late packet may skip the grid
LATE_PACKETS_OF_A_MOVED_GRID = 4  # packets in a row, each as late as the first
LEAST_STEP_PERIODS = 0.25  # shortest time between two sampling times, in periods
# packets that set the loop's gains: at the start, and at most
FIRST_COUNT, MOST_COUNT = 4, 256
LEARNING_PACKETS = 32  # packets until which the loop still learns the period
COUNT_AFTER_MOVE = 16  # packets that set the gains after the grid has moved, at most
# share of a packet in the estimate of how early packets come: for an earlier and a later packet
EARLIER_SHARE, LATER_SHARE = 0.1, 0.005
PERIOD_SPREAD = 0.08  # share by which the period may differ from the nominal period


@dataclass(frozen=True)
class Timing:
    """Report what a clock has measured.

    period_s: s; the measured period.
    lost: samples that never came.
    begun: how often a new grid began after the first (a long gap, or the system's clock was set).
    set_back: how many of these went back in time.
    """

    period_s: float
    lost: int = 0
    begun: int = 0
    set_back: int = 0


class ArrivalClock:
    """Give each packet, in order, its sampling time.

    rate_hz: Hz; the nominal rate, within 5 % of the true rate.
    most_lost: whole periods that a late packet may stand for; 0 over TCP, where nothing is lost.
    """

    def __init__(self, rate_hz: float, most_lost: int = MOST_LOST) -> None:
        self._most_lost = most_lost
        self._nominal_ns = self._period_ns = 1e9 / rate_hz
        self._origin_ns: int | None = None  # the grid's times count from it
        self._grid_ns = 0.0  # ns; of the last packet, from the origin
        self._early_ns = 0.0  # at most 0; early packets come so far before the grid
        self._given_ns = 0
        self._seen = FIRST_COUNT
        self._floor_ns = 0.0  # least lateness of the packets that are late now
        self._late = 0  # how many packets in a row were no earlier
        self._lost = self._begun = self._set_back = 0

    @property
    def timing(self) -> Timing:
        """What was measured so far."""
        return Timing(1e-9 * self._period_ns, self._lost, self._begun, self._set_back)

    def stamp(self, arrival_ns: int) -> int:
        """Return the sampling time of the packet that came at arrival_ns.

        Both are in ns of the system clock.
        """
        if self._origin_ns is None:
            return self._begin(arrival_ns)
        off_ns = arrival_ns - self._origin_ns - self._grid_ns - self._period_ns
        if abs(off_ns) > 1e9 * RESTART_S:
            self._begun += 1
            self._set_back += arrival_ns <= self._given_ns
            return self._begin(arrival_ns)
        self._grid_ns += self._period_ns
        self._follow(self._remove_whole_periods(off_ns))
        least = self._given_ns + max(round(LEAST_STEP_PERIODS * self._period_ns), 1)
        self._given_ns = max(self._origin_ns + round(self._grid_ns + self._early_ns), least)
        return self._given_ns

    @property
    def _tolerance_ns(self) -> float:
        return (
            TOLERANCE_PERIODS if self._seen >= LEARNING_PACKETS else FIRST_TOLERANCE_PERIODS
        ) * self._period_ns

    def _begin(self, arrival_ns: int) -> int:
        self._origin_ns = self._given_ns = arrival_ns
        self._grid_ns, self._early_ns, self._period_ns = 0.0, 0.0, self._nominal_ns
        self._seen, self._late = FIRST_COUNT, 0
        return arrival_ns

    def _remove_whole_periods(self, off_ns: float) -> float:
        """Move the grid by the whole periods that a packet is off; return the remainder, ns."""
        periods = round(off_ns / self._period_ns)
        rest_ns = off_ns - periods * self._period_ns
        lost = 0 < periods <= self._most_lost and abs(rest_ns) < self._tolerance_ns
        if not (lost or periods < 0):
            return off_ns
        self._grid_ns += periods * self._period_ns
        if periods >= -MOST_LOST:
            self._lost = max(self._lost + periods, 0)
        return rest_ns

    def _follow(self, off_ns: float) -> None:
        """Move the grid towards a packet that is off_ns later than the grid."""
        if off_ns > self._tolerance_ns:
            self._hold_out(off_ns)
            return
        self._late = 0
        if off_ns < -self._tolerance_ns:  # no packet comes before it is sent: the grid was late
            self._move(off_ns)
            return
        n = self._seen
        self._seen = min(n + 1, MOST_COUNT)
        self._grid_ns += off_ns * (4 * n + 2) / ((n + 1) * (n + 2))
        period_ns = self._period_ns + off_ns * 6 / ((n + 1) * (n + 2))
        self._period_ns = min(
            max(period_ns, (1 - PERIOD_SPREAD) * self._nominal_ns),
            (1 + PERIOD_SPREAD) * self._nominal_ns,
        )
        if n >= LEARNING_PACKETS:
            beyond_ns = off_ns - self._early_ns
            self._early_ns = min(
                self._early_ns + beyond_ns * (EARLIER_SHARE if beyond_ns < 0 else LATER_SHARE), 0.0
            )

    def _hold_out(self, off_ns: float) -> None:
        """Keep the grid although a packet is late, unless packets stay as late."""
        if not self._late or off_ns < self._floor_ns - 2 * TOLERANCE_PERIODS * self._period_ns:
            self._floor_ns, self._late = off_ns, 0  # the burst catches up
        self._floor_ns = min(self._floor_ns, off_ns)
        self._late += 1
        if self._late >= LATE_PACKETS_OF_A_MOVED_GRID:
            self._lost += round(self._floor_ns / self._period_ns)
            self._move(self._floor_ns)

    def _move(self, by_ns: float) -> None:
        self._grid_ns += by_ns
        self._seen, self._late = min(self._seen, COUNT_AFTER_MOVE), 0
