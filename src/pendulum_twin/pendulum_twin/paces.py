"""Keep pace with real time, or in lockstep with a user: which sample answers which command.

Samples are numbered k = 0, 1, ...; sample 0 is the start state.

Real time: sample k is due at its time, whether commands come or not. From sample k to sample k + 1
the last command is held that arrived within half a period after sample k (0 when stale): a command
acts from the sampling time nearest to it, as in `rig_emulator`. So the answer to sample k acts
from sample k on, and shows first in sample k + 1.

Lockstep: simulated time stands still until a command comes. The k-th command (from 0) is held from
sample k to sample k + 1, and is answered by sample k + 1: one command in, one sample out, in
order. Sample k has the time k * period. A command that is no finite number is refused and gets no
answer; no command is ever stale. A reset counts as a step without a command: its sample is the
start state, and time goes on.
"""

from __future__ import annotations

from typing import Protocol

from pendulum_twin.arrays import Floats
from pendulum_twin.live_twin import LiveTwin
from pendulum_twin.sample_clock import SampleClock


class Outlet(Protocol):
    """Take what a live twin gives out."""

    def publish_sample(self, state: Floats, stamp_ns: int) -> None:
        """Take the measured state x, th, v, w, shape (4,), at a time, ns."""

    def publish_applied(self, pwm: float) -> None:
        """Take the PWM fraction that is held from the last sample to the next."""


class RealTime:
    """Give out samples when they are due, and settle the command of each half a period later."""

    def __init__(self, live: LiveTwin, period_s: float, outlet: Outlet) -> None:
        self._live = live
        self._outlet = outlet
        self._clock = SampleClock(period_s)
        self._open = False  # whether the last sample's command is not settled yet
        self.samples = 0

    @property
    def lost(self) -> int:
        """Return how many samples a standing machine has cost."""
        return self._clock.lost

    def take_command(self, value: float, now_ns: int) -> bool:
        """Take a command that arrived at now_ns and return True, or refuse it."""
        return self._live.commands.offer(value, now_ns)

    def tick(self, now_ns: int) -> None:
        """Give out the samples that are due, usually one."""
        for stamp_ns in self._clock.take_due_times(now_ns):
            self.settle(stamp_ns)  # when no call came in time
            self._outlet.publish_sample(self._live.state, stamp_ns)
            self.samples += 1
            self._open = True

    def settle(self, now_ns: int) -> None:
        """Hold the last command from the last sample to the next.

        To be called half a period after each sample.
        """
        if self._open:
            self._open = False
            self._outlet.publish_applied(self._live.advance(now_ns))

    def reset(self) -> None:
        """Hang at rest in the middle of the rail from the next sample on."""
        self._live.reset()
        if self._open:
            self._open = False
            self._outlet.publish_applied(0.0)


class Lockstep:
    """Give out a sample for each command."""

    lost = 0  # nothing is late where time waits

    def __init__(self, live: LiveTwin, period_s: float, outlet: Outlet) -> None:
        self._live = live
        self._outlet = outlet
        self._period_ns = period_s * 1e9
        self.samples = 0

    def tick(self, now_ns: int) -> None:
        """Give out the start state, once."""
        if self.samples == 0:
            self._give_sample()

    def take_command(self, value: float, now_ns: int) -> bool:
        """Answer a command with a sample and return True, or refuse it."""
        if not self._live.commands.offer(value, now_ns):
            return False
        self._outlet.publish_applied(self._live.advance(now_ns))
        self._give_sample()
        return True

    def settle(self, now_ns: int) -> None:
        """Do nothing: each command is settled as it comes."""

    def reset(self) -> int:
        """Hang at rest in the middle of the rail; return the stamp of its sample, ns."""
        self._live.reset()
        return self._give_sample()

    def _give_sample(self) -> int:
        stamp_ns = round(self.samples * self._period_ns)
        self._outlet.publish_sample(self._live.state, stamp_ns)
        self.samples += 1
        return stamp_ns
