"""Lockstep: time stands still until a command comes, and every command is answered by one sample."""

from __future__ import annotations

from pendulum_rl_env.pacing.link import Received, RigLink
from pendulum_rl_env.pacing.sequence import StampSequence
from pendulum_rl_env.transport import NoAnswerError, Sample
from pendulum_twin.errors import BadInputError

PERIOD_TOLERANCE = 0.01  # share by which so many sample periods may differ from a step


class LockstepPace:
    """Send each command as often as a step has samples, and take the answer to each before the next.

    How many samples these are is seen in the stamps of the first step. See `TopicTransport` for
    what is told.
    """

    def __init__(self, link: RigLink, step_s: float, deadline_s: float) -> None:
        self._link, self._step_s, self._deadline_s = link, step_s, deadline_s
        self._sequence = StampSequence()

    def begin(self, told_ns: int | None) -> Sample | None:
        """Return the sample whose stamp the reset told, None when it does not come.

        Raises BadInputError when the reset told none: then what answered it does not run in
        lockstep.
        """
        if told_ns is None:
            raise BadInputError(
                f"{self._link.name}: expected a twin in lockstep, found one, or a rig, in real time: start twin_node with "
                "lockstep:=true, or give lockstep=False"
            )
        end_s = self._link.now_s() + self._deadline_s
        while (received := self._link.wait(end_s - self._link.now_s())) is not None:
            if received.stamp_ns == told_ns:
                self._sequence = StampSequence(last_ns=told_ns)
                return self._told(received, told_ns, 0.0)
        return None

    def exchange(self, command: float) -> Sample:
        """Hold a command for a step and return its last sample; raise `NoAnswerError` when one does not come."""
        if self._sequence.last_ns is None:
            raise BadInputError(
                f"{self._link.name}: expected a reset before the first command, found none"
            )
        while (waiting := self._link.wait(0.0)) is not None:  # an answer to somebody else
            if self._sequence.follows(waiting.stamp_ns):
                self._sequence.stale += 1
        before_ns, sent_s = self._sequence.last_ns, self._link.now_s()
        last = self._answered(command)
        latency_s = last.arrived_s - sent_s
        for _ in range(self._samples(before_ns, last.stamp_ns) - 1):
            last = self._answered(command)
        return self._told(last, before_ns, latency_s)

    def _answered(self, command: float) -> Received:
        self._link.send(command)
        end_s = self._link.now_s() + self._deadline_s
        while (received := self._link.wait(end_s - self._link.now_s())) is not None:
            if self._sequence.follows(received.stamp_ns):
                return received
        raise NoAnswerError(
            f"{self._link.name}: expected an answer to a command within {self._deadline_s:g} s, found none: "
            "see that the twin still runs, then reset"
        )

    def _samples(self, before_ns: int, answered_ns: int) -> int:
        """Return how many samples a step has; its first answer shows it."""
        if self._sequence.period_ns is None:
            self._sequence.period_ns = float(answered_ns - before_ns)
        period_s = 1e-9 * self._sequence.period_ns
        count = round(self._step_s / period_s)
        if abs(count * period_s - self._step_s) > PERIOD_TOLERANCE * self._step_s:
            raise BadInputError(
                f"{self._link.name}: expected a whole number of sample periods in a step of {1e3 * self._step_s:g} ms, "
                f"found samples every {1e3 * period_s:g} ms: set rate_hz of the twin, or step_s"
            )
        return count

    def _told(self, received: Received, before_ns: int, latency_s: float) -> Sample:
        info = {
            "dt_s": (received.stamp_ns - before_ns) / 1e9,
            "age_s": 0.0,  # simulated time waits for the command
            "latency_s": latency_s,
            "overrun_s": 0.0,
            "missed": 0.0,
            "lost": float(self._sequence.lost),
            "stale": float(self._sequence.stale),
        }
        return Sample(received.state, received.stamp_ns / 1e9, info)
