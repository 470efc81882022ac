"""Commands by when they came after a sample: from which sample each of them may have acted.

A rig takes a command from the nearest of its samples on. By the recording's stamps the commands
and the samples stand on one clock; where that clock is off, the time at which a command begins to
count as the next sample's is not the middle of two stamps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.command_doubt import CommandDoubt
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.signals import Signals

MOST_BETWEEN = 8  # commands between two samples; of a longer burst no time is believed
STEPS = (
    81  # from the least error to the most: a hundredth of a period where both clocks are unknown
)
ROUNDS = 6  # at most: error and drift of the clock are sought in turn


@dataclass(frozen=True)
class ClockError:
    """Hold by how much commands came later than their stamps say, beside the samples.

    late: periods, in the middle of the recording.
    drift: periods, from its beginning to its end.
    """

    late: float = 0.0
    drift: float = 0.0

    @property
    def cost(self) -> float:
        """Return the nats by which the motion must speak for this error against none."""
        off = abs(self.late) + abs(self.drift)
        dear = decisions.COMMAND_MOVED_NATS + decisions.COMMAND_FARTHER_NATS * off
        return dear if off else 0.0


@dataclass(frozen=True)
class ClockBounds:
    """Hold by how much the samples' clock may be off, beside that of the commands.

    late: periods, least and most.
    drift: periods; the most, either way.
    """

    late: tuple[float, float]
    drift: float

    @property
    def expected(self) -> ClockError:
        """Return the error in the middle."""
        return ClockError(0.5 * sum(self.late))

    def search(self, gain: Callable[[ClockError], float], begin: ClockError) -> ClockError:
        """Return the error that gains most beyond what it costs.

        gain: nats, of an error; `begin` stays where no other gains more.
        """

        def measure(clock: ClockError) -> float:
            return gain(clock) - clock.cost

        late = np.linspace(*self.late, STEPS).tolist()
        drift = np.linspace(-self.drift, self.drift, STEPS if self.drift else 1).tolist()
        clock = begin
        for _ in range(ROUNDS):
            before = clock
            clock = max([clock, *(replace(clock, late=step) for step in late)], key=measure)
            clock = max([clock, *(replace(clock, drift=step) for step in drift)], key=measure)
            if clock == before:
                break
        return clock


FAR = decisions.COMMAND_CLOCK_OFF


def find_clock_bounds(placed: bool, period_s: float) -> ClockBounds:
    """Return by how much the samples' clock may be off.

    placed: whether samples stand where the soonest of them are received at once, as commands do.
    """
    if placed:
        return ClockBounds((0.0, min(decisions.SOONEST_S / period_s, FAR)), 0.0)
    return ClockBounds((-FAR, FAR), FAR)


@dataclass(frozen=True)
class CommandArrivals:
    """Hold the sample periods in which commands came.

    Of the commands that came between a sample and the next, the first few acted from the sample,
    and the others from the next: an option is how many.

    samples: (k,) numbers of the samples that begin the periods.
    place: (k,) where in the recording each stands, from -0.5 to 0.5.
    values: (k, options) PWM fraction in force from the sample on; 0 where there is no such option.
    starts, ends: (k, options) periods after the sample: the option is the nearest where commands
        begin to count as the next sample's in between; infinite where there is no such option.
    """

    samples: Ints
    place: Floats
    values: Floats
    starts: Floats
    ends: Floats

    @property
    def leave_doubt(self) -> bool:
        """Return whether a clock that is off changes from which sample a command acts."""
        early, late = self.weigh(ClockError(-FAR)), self.weigh(ClockError(FAR))
        return not np.array_equal(early.chosen, late.chosen)

    def weigh(self, clock: ClockError) -> CommandDoubt:
        """Return what each option costs, the nearest chosen, if the clock is off by so much.

        An option costs the more the farther the commands that it moves came from the middle of
        two samples.
        """
        middle = 0.5 - clock.late - clock.drift * self.place[:, None]
        apart = np.maximum(self.starts - middle, 0.0) + np.maximum(middle - self.ends, 0.0)
        nearest = np.argmin(apart, axis=1)
        dear = decisions.COMMAND_MOVED_NATS + decisions.COMMAND_FARTHER_NATS * apart
        costs = np.where(apart < decisions.COMMAND_MIDWAY, dear, np.inf)
        costs[np.arange(len(costs)), nearest] = 0.0
        return CommandDoubt(self.samples, self.values, costs, nearest.astype(np.int64))

    def find_clock_error(
        self, gains: Floats, bounds: ClockBounds, begin: ClockError
    ) -> ClockError:
        """Return the error of the clock that gains most, single late commands beside it.

        gains: (k, options) nats by which the motion speaks for each option.
        begin: the error that stays where no other gains more.
        """
        return bounds.search(lambda clock: self.weigh(clock).sum_best_gains(gains), begin)


def list_arrivals(signals: Signals, stamps: Floats, commands: Floats) -> CommandArrivals:
    """Return the sample periods in which a command came that differs from the command before.

    stamps, commands: (m,) when each command came, s, rising, and its value.
    """
    changes = np.diff(commands, prepend=np.nan) != 0.0  # a driver may send a command again
    stamps, commands = stamps[changes], commands[changes]
    clock, period_s = signals.clock_s, signals.period_s
    first = np.searchsorted(stamps, clock, side="right")
    count = np.searchsorted(stamps, clock + period_s, side="left") - first
    rows = np.flatnonzero((count > 0) & (count <= MOST_BETWEEN) & (first > 0))
    options = np.arange(int(np.max(count[rows], initial=0)) + 1)
    first, count = first[rows, None], count[rows, None]
    following = np.minimum(first + options, len(stamps) - 1)
    came = np.where(options < count, (stamps[following] - clock[rows, None]) / period_s, 1.0)
    starts = np.column_stack([np.zeros(len(rows)), came[:, :-1]])
    starts[options > count] = np.inf
    in_force = commands[np.minimum(first + options, len(commands)) - 1]
    length_s = max(float(np.ptp(stamps)), period_s)
    return CommandArrivals(
        rows,
        (clock[rows] - stamps[0]) / length_s - 0.5,
        np.where(options > count, 0.0, in_force),
        starts,
        came,
    )
