"""Lockstep: time stands still until a command comes, and one sample answers each command."""

from __future__ import annotations

from pendulum_rl_env.pacing.link import Received, RigLink
from pendulum_rl_env.pacing.sequence import StampSequence
from pendulum_rl_env.transport import NoAnswerError, Sample
from pendulum_twin.errors import BadInputError

PERIOD_TOLERANCE = 0.01  # share by which a step may differ from a whole number of sample periods


class LockstepPace:
    """Send each command once for every sample of a step, and await each answer.

    The stamps of the first step show how many samples a step has. See `TopicTransport` for each
    sample's info.

    link: carries commands and samples.
    step_s: s; the period.
    deadline_s: s; for one answer.
    """

    def __init__(self, link: RigLink, step_s: float, deadline_s: float) -> None:
        self._link, self._step_s, self._deadline_s = link, step_s, deadline_s
        self._sequence = StampSequence()

    def begin(self, stamp_ns: int | None) -> Sample | None:
        """Return the sample whose stamp the reset has announced; None when it does not come.

        stamp_ns: ns; None when the reset announced none.

        Raises BadInputError without a stamp: then the twin or rig is not in lockstep.
        """
        if stamp_ns is None:
            raise BadInputError(
                f"{self._link.name}: expected a twin in lockstep, found one, or a rig, in real "
                "time: start twin_node with lockstep:=true, or give lockstep=False"
            )
        end_s = self._link.now_s() + self._deadline_s
        while (received := self._link.wait(end_s - self._link.now_s())) is not None:
            if received.stamp_ns == stamp_ns:
                self._sequence = StampSequence(last_ns=stamp_ns)
                return self._make_sample(received, stamp_ns, 0.0)
        return None

    def exchange(self, command: float) -> Sample:
        """Hold a command for a step and return its last sample; raise NoAnswerError on silence."""
        if self._sequence.last_ns is None:
            raise BadInputError(
                f"{self._link.name}: expected a reset before the first command, found none"
            )
        while (waiting := self._link.wait(0.0)) is not None:  # an answer to another program
            if self._sequence.accept(waiting.stamp_ns):
                self._sequence.stale += 1
        before_ns, sent_s = self._sequence.last_ns, self._link.now_s()
        last = self._ask(command)
        latency_s = last.arrived_s - sent_s
        for _ in range(self._count_samples(before_ns, last.stamp_ns) - 1):
            last = self._ask(command)
        return self._make_sample(last, before_ns, latency_s)

    def _ask(self, command: float) -> Received:
        self._link.send(command)
        end_s = self._link.now_s() + self._deadline_s
        while (received := self._link.wait(end_s - self._link.now_s())) is not None:
            if self._sequence.accept(received.stamp_ns):
                return received
        raise NoAnswerError(
            f"{self._link.name}: expected an answer to a command within {self._deadline_s:g} s, "
            "found none: see that the twin still runs, then reset"
        )

    def _count_samples(self, before_ns: int, answered_ns: int) -> int:
        """Return how many samples a step has; its first answer shows the period."""
        if self._sequence.period_ns is None:
            self._sequence.period_ns = float(answered_ns - before_ns)
        period_s = 1e-9 * self._sequence.period_ns
        count = round(self._step_s / period_s)
        if abs(count * period_s - self._step_s) > PERIOD_TOLERANCE * self._step_s:
            raise BadInputError(
                f"{self._link.name}: expected a whole number of sample periods in a step of "
                f"{1e3 * self._step_s:g} ms, found samples every {1e3 * period_s:g} ms: set "
                "rate_hz of the twin, or step_s"
            )
        return count

    def _make_sample(self, received: Received, before_ns: int, latency_s: float) -> Sample:
        info = {
            "dt_s": (received.stamp_ns - before_ns) / 1e9,
            "delay_s": 0.0,  # simulated time waits for the command
            "age_s": 0.0,
            "latency_s": latency_s,
            "overrun_s": 0.0,
            "missed": 0.0,
            "lost": float(self._sequence.lost),
            "stale": float(self._sequence.stale),
        }
        return Sample(received.state, received.stamp_ns / 1e9, info)
