"""Real time: the rig samples by itself, and a step ends when its time is over.

Steps end at instants of a schedule, `step_s` apart, from the sample that an episode's first
command answered. A step is over when the sample of its instant has come, or, without it, a sample
period later. So the next command acts from that sample on, as in the twin in process, and the
stamps of returned samples are a step apart even when some samples come late.
"""

from __future__ import annotations

from dataclasses import dataclass

from pendulum_rl_env.pacing.link import Received, RigLink
from pendulum_rl_env.pacing.schedule import Schedule
from pendulum_rl_env.pacing.sequence import StampSequence, compute_period_ns
from pendulum_rl_env.transport import NoAnswerError, Sample
from pendulum_twin.errors import BadInputError

LATE_PERIODS = 1.0  # that a step waits for the sample of its instant
PERIOD_SAMPLES = 5  # from which the rig's period is measured
SPARSEST_STEPS = 1.5  # from sample to sample: a grid of samples may be off by half a step


@dataclass(frozen=True)
class StepSamples:
    """Hold the samples of a step.

    first: the first that is later than the command.
    last: the newest at the step's end.
    """

    first: Received
    last: Received


class RealTimePace:
    """Send a command and wait for the end of its step.

    See `TopicTransport` for each sample's info.

    link: carries commands and samples.
    step_s: s; the period.
    deadline_s: s; for a sample later than a command.
    """

    def __init__(self, link: RigLink, step_s: float, deadline_s: float) -> None:
        self._link, self._deadline_s = link, deadline_s
        self._schedule, self._sequence = Schedule(step_s), StampSequence()
        # ns; stamp of the sample with which the present step began, None before the first
        self._last_ns: int | None = None

    def begin(self, stamp_ns: int | None) -> Sample:
        """Return the first sample of an episode; its time counts from the first command.

        stamp_ns: None, for a rig in real time announces none.

        Raises BadInputError when the rig is not in real time or its samples are too far apart,
        NoAnswerError when they do not come.
        """
        if stamp_ns is not None:
            raise BadInputError(
                f"{self._link.name}: expected a rig or a twin in real time, found a twin in "
                "lockstep: give lockstep=True, or start twin_node with lockstep:=false"
            )
        samples = [self._wait_for_later(self._link.now_ns())]
        while len(samples) < PERIOD_SAMPLES:
            samples.append(self._wait_for_later(samples[-1].stamp_ns))
        period_ns = compute_period_ns([sample.stamp_ns for sample in samples])
        self._check(period_ns, samples[-1])
        self._schedule, self._sequence = Schedule(self._schedule.step_s), StampSequence(period_ns)
        self._last_ns = None
        return self._make_sample(samples[-1], 0.0, 0.0, 0.0, 0.0)

    def exchange(self, command: float) -> Sample:
        """Send a command at once and return the newest sample at the end of its step.

        An episode's first command waits for a sample to answer. Raises NoAnswerError when no
        sample comes that is later than the command.
        """
        before_ns = self._start() if self._last_ns is None else self._last_ns
        overrun_s = self._schedule.advance(self._link.now_s(), self._link.now_ns())
        if overrun_s > 0.0:
            self._sequence.last_ns = None  # samples that were not fetched meanwhile are not lost
        # Whatever their stamps, samples that wait here are from before the command.
        while (waiting := self._link.wait(0.0)) is not None:
            self._sequence.accept(waiting.stamp_ns)
        self._link.send(command)
        sent_s, sent_ns = self._link.now_s(), self._link.now_ns()
        answer = self._wait_for_answer(sent_s, sent_ns)
        if overrun_s > 0.0:
            self._schedule.start(answer.last.arrived_s, answer.last.stamp_ns)
        self._last_ns = answer.last.stamp_ns
        dt_s, delay_s = (answer.last.stamp_ns - before_ns) / 1e9, (sent_ns - before_ns) / 1e9
        latency_s = answer.first.arrived_s - sent_s
        return self._make_sample(answer.last, dt_s, delay_s, latency_s, overrun_s)

    def _start(self) -> int:
        """Let time count from the next sample on; return its stamp, ns."""
        if self._sequence.period_ns is None:
            raise BadInputError(
                f"{self._link.name}: expected a reset before the first command, found none"
            )
        while self._link.wait(0.0) is not None:
            pass
        base = self._wait_for_later(-1)
        self._sequence.last_ns = base.stamp_ns
        self._schedule.start(base.arrived_s, base.stamp_ns)
        return base.stamp_ns

    def _wait_for_answer(self, sent_s: float, sent_ns: int) -> StepSamples:
        """Return the samples of the present step, at its end."""
        period_ns = self._sequence.period_ns or 0.0
        over_s = self._schedule.end_s + LATE_PERIODS * period_ns / 1e9
        first = last = self._wait_for_first(sent_s + self._deadline_s, sent_ns)
        while True:
            now_s = self._link.now_s()
            reached = last.stamp_ns >= self._schedule.end_ns - period_ns / 2
            received = self._link.wait(0.0 if reached else over_s - now_s)
            if received is not None:
                last = received if self._sequence.accept(received.stamp_ns) else last
            elif reached or now_s >= over_s:
                return StepSamples(first, last)

    def _wait_for_first(self, end_s: float, after_ns: int) -> Received:
        """Return the first sample in order later than after_ns; raise NoAnswerError at end_s."""
        newest_ns = None
        while (received := self._link.wait(end_s - self._link.now_s())) is not None:
            newest_ns = received.stamp_ns
            if self._sequence.accept(newest_ns) and newest_ns > after_ns:
                return received
        raise NoAnswerError(self._describe_silence(after_ns, newest_ns))

    def _wait_for_later(self, after_ns: int) -> Received:
        """Return the next sample later than after_ns; raise NoAnswerError after the deadline."""
        end_s, newest_ns = self._link.now_s() + self._deadline_s, None
        while (received := self._link.wait(end_s - self._link.now_s())) is not None:
            newest_ns = received.stamp_ns
            if newest_ns > after_ns:
                return received
        raise NoAnswerError(self._describe_silence(after_ns, newest_ns))

    def _describe_silence(self, after_ns: int, newest_ns: int | None) -> str:
        expected = (
            f"{self._link.name}: expected a sample later than the command within "
            f"{self._deadline_s:g} s, found "
        )
        if newest_ns is None:
            return f"{expected}none: see that the rig is on and its driver runs, then reset"
        behind_s = 1e-9 * (after_ns - newest_ns)
        return (
            f"{expected}none later than {behind_s:.3f} s before it: see that both machines' "
            "clocks are set alike"
        )

    def _check(self, period_ns: float, newest: Received) -> None:
        """Raise BadInputError when samples are too sparse, or stamped in the future."""
        step_s = self._schedule.step_s
        if 1e-9 * period_ns > SPARSEST_STEPS * step_s:
            raise BadInputError(
                f"{self._link.name}: expected samples at least every {1e3 * step_s:g} ms, found "
                f"one every {1e-6 * period_ns:g} ms: raise the rig's rate, or step_s"
            )
        ahead_s = 1e-9 * (newest.stamp_ns - self._link.now_ns())
        if ahead_s > step_s:
            raise BadInputError(
                f"{self._link.name}: expected samples from the past, found one stamped "
                f"{ahead_s:.3f} s ahead of this machine's clock: see that both machines' clocks "
                "are set alike"
            )

    def _make_sample(
        self,
        received: Received,
        dt_s: float,
        delay_s: float,
        latency_s: float,
        overrun_s: float,
    ) -> Sample:
        info = {
            "dt_s": dt_s,
            "delay_s": delay_s,
            "age_s": 1e-9 * (self._link.now_ns() - received.stamp_ns),
            "latency_s": latency_s,
            "overrun_s": overrun_s,
            "missed": float(self._schedule.missed),
            "lost": float(self._sequence.lost),
            "stale": float(self._sequence.stale),
        }
        return Sample(received.state, received.stamp_ns / 1e9, info)
