"""The running driver: samples and commands in, decisions out to the rig at once, from any thread.

A lock holds all state. Decisions are sent and published under it, so that the rig gets them in
order.

A driver that is behind, on a busy computer, decides on the newest sample that has come, and
publishes one of the samples that wait, in order, between two decisions. Measured with a rig at
1000 Hz and two busy processes on two cores: while the driver took sample after sample, every
sample was old when its turn came, the rig held the last command, and 1 of 4 runs of 200 resets
threw a hanging pole.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from threading import Event, Lock

from pendulum_bridge.driver.arrival_clock import MOST_LOST, ArrivalClock
from pendulum_bridge.driver.health import Report, make_health, pick_worse
from pendulum_bridge.driver.last_word import LastWord, describe_left_pwm
from pendulum_bridge.driver.latency import Latency
from pendulum_bridge.driver.outlet import Outlet
from pendulum_bridge.driver.waiting_samples import WaitingSamples
from pendulum_bridge.safety import events
from pendulum_bridge.safety.decide import decide
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.rig_state import RigState
from pendulum_bridge.safety.state import Counts, Rules, make_safety
from pendulum_bridge.wire.link import Arrival, Link
from pendulum_bridge.wire.protocol import Command
from pendulum_twin.errors import BadInputError
from pendulum_twin.health import Health

# longest time without a decision; with what follows a wait, less than the rail guard's hold_s
WAIT_S = 0.02
# decisions on commands between two samples; the last of more commands waits for the sample
DECISIONS_BETWEEN = 5
LAST_WORDS = 5  # packets with PWM 0 at the end: any may be lost
Listener = Callable[[Reason], None]


class Driver:
    """Drive a rig by the rules. Close the driver after use: the rig holds its last command.

    link: to the rig; closed with the driver.
    rules: constants of the decisions.
    outlet: takes samples and applied commands.
    last_word: sends PWM 0 when this process no longer can; closed with the driver.
    now: s, monotonic; the clock.
    lossless: whether the link delivers every sample, so that a late sample is only late.
    active: whether commands and resets are accepted from the beginning.
    """

    def __init__(
        self,
        link: Link,
        rules: Rules,
        outlet: Outlet,
        last_word: LastWord,
        now: Callable[[], float] = time.monotonic,
        lossless: bool = False,
        active: bool = True,
    ) -> None:
        self._now = now
        self._link, self._rules, self._outlet, self._last_word = link, rules, outlet, last_word
        self._clock = ArrivalClock(1 / rules.period_s, 0 if lossless else MOST_LOST)
        self._lock = Lock()
        self._safety = replace(make_safety(self._now()), active=active)
        self._since_sample = 0  # decisions on commands since the last sample
        self._listeners: list[Listener] = []  # they wait for the end of a reset
        self._closed = False
        self._fault, self._out_pwm = "", 0.0  # what went out last
        self._decided_s, self._standstill_s = self._now(), 0.0
        self._taken_s = self._now()  # when all samples were taken that had come
        self._worst: Reason | None = Reason.NO_SAMPLE_YET
        self._reported = (self._now(), 0)
        self._unsent = self._old = self._commands = self._resets = 0
        self._waiting = WaitingSamples()
        self._sample_latency, self._command_latency = Latency(), Latency()

    @property
    def stopped(self) -> bool:
        """Whether the emergency stop is latched."""
        return self._safety.stop.latched

    @property
    def needs_person(self) -> bool:
        """Whether PWM is 0 until a person clears the stop: it is latched, or encoders failed."""
        return self.stopped or events.find_lasting_fault(self._safety) is not None

    @property
    def counts(self) -> Counts:
        """What was refused so far."""
        return self._safety.counts

    def serve(self, ended: Event) -> None:
        """Take samples and watch for silence until ended is set; any failure brings PWM to 0.

        Samples that came before, while the driver was not yet ready, are dropped.
        """
        self._link.drop_waiting()
        while not ended.is_set():
            try:
                self.turn()
            except Exception as error:  # the thread that watches must not die
                if ended.is_set():
                    return
                self.fail_safe()
                self._outlet.report_failure(error)
                ended.wait(WAIT_S)

    def turn(self) -> None:
        """Wait for a sample, publish it, and decide on the newest; without any when none comes."""
        came, before_s = self._publish_next(), self._taken_s
        self._taken_s = self._now()
        newer = self._link.take_waiting()
        self._waiting.add(newer)
        came += newer
        with self._lock:
            self._since_sample = 0
            self._old += max(len(came) - 1, 0)
            if came:
                ago_s = 1e-9 * (time.time_ns() - came[-1].arrival_ns)
                # the sample came since the turn before; otherwise the system's clock was set
                most_s = self._now() - before_s
                ago_s = ago_s if 0 <= ago_s <= most_s else most_s
                self._decide(read_state(came[-1]), ago_s, skipped=len(came) - 1)
            else:
                self._decide(None)
        self._last_word.alive()

    def command(self, pwm: float, sent_ns: int | None = None) -> Reason | None:
        """Take a command, act on it at once, and return why it was refused; None if it was not.

        pwm: PWM fraction.
        sent_ns: ns, system clock; when its writer sent it.
        """
        with self._lock:
            self._commands += 1
            ago_s = 0.0 if sent_ns is None else 1e-9 * (time.time_ns() - sent_ns)
            self._safety, refused = events.take_command(
                pwm, self._safety, self._now(), ago_s, self._rules.timeouts.command_s
            )
            self._note(refused)
            if self._since_sample < DECISIONS_BETWEEN:
                self._since_sample += 1
                self._decide(None)
                if sent_ns is not None:
                    self._command_latency.add(1e-9 * (time.time_ns() - sent_ns))
            return refused

    def hear_writer(self, number: int) -> None:
        """Note a message with this number of some writer of commands, to detect two writers."""
        with self._lock:
            self._safety = events.hear_writer(number, self._now(), self._safety)

    def stop(self) -> Reason:
        """Latch the emergency stop; PWM 0 is sent before this returns."""
        with self._lock:
            self._safety, ended = events.press_stop(self._safety)
            self._decide(None)
            self._end_reset(ended)
            self._outlet.publish_stopped(True)
            return Reason.STOPPED

    def clear_stop(self) -> Reason:
        """Clear the emergency stop, or return why it stays."""
        with self._lock:
            self._safety, reason = events.clear_stop(self._safety, self._rules)
            self._outlet.publish_stopped(self._safety.stop.latched)
            return reason

    def activate(self) -> None:
        """Accept commands and resets from now on."""
        with self._lock:
            self._safety = events.activate(self._safety, self._now())

    def deactivate(self) -> None:
        """Send PWM 0 before this returns, and nothing else until `activate`."""
        with self._lock:
            self._safety, ended = events.deactivate(self._safety)
            self._decide(None)
            self._end_reset(ended)

    def reset(self, listener: Listener) -> None:
        """Begin a reset, or join the reset under way.

        listener: gets how the reset ended, from another thread, or at once why it cannot begin.
        """
        with self._lock:
            self._safety, reason = events.begin_reset(self._now(), self._safety, self._rules)
            if self._closed:
                reason = Reason.RESET_ENDED
            if reason is Reason.RESETTING:
                self._listeners.append(listener)
                return
        listener(reason)

    def change_rules(self, rules: Rules) -> None:
        """Apply these rules from the next decision on."""
        with self._lock:
            self._safety = events.change_rules(self._safety, self._rules, rules)
            self._rules = rules

    def fail_safe(self) -> None:
        """Send PWM 0 and forget command and reset, after a failure of the caller."""
        with self._lock:
            self._safety, ended = events.fail_safe(self._safety)
            self._fault = Reason.FAILED.sentence
            self._send_zero()
            self._end_reset(ended)

    def close(self) -> str:
        """Send PWM 0 and release the rig; a second call does nothing.

        Returns that the rig may hold another command, because no PWM 0 went out; else empty.
        """
        with self._lock:
            if self._closed:
                return ""
            for _ in range(LAST_WORDS):
                self._send_zero()
            self._closed = True
            self._end_reset(Reason.RESET_ENDED)
            self._last_word.close(self._out_pwm)
            self._link.close()
            return describe_left_pwm(self._out_pwm, self._fault) if self._out_pwm else ""

    def health(self) -> Health:
        """Return the driver's health since the last call."""
        with self._lock:
            received, now = self._link.counts.received, self._now()
            (since_s, before), self._reported = self._reported, (now, received)
            report = Report(
                self._worst,
                self._describe_trouble(),
                received - before,
                now - since_s,
                1 / self._rules.period_s,
                self._standstill_s if self._standstill_s > events.STANDSTILL_S else 0.0,
            )
            self._worst, self._fault, self._standstill_s = None, "", 0.0
            figures = self._collect_figures()
        return make_health(report, figures)

    def _describe_trouble(self) -> str:
        return self._link.trouble or self._fault

    def _collect_figures(self) -> dict[str, float | int | str]:
        wire, timing, safety = self._link.counts, self._clock.timing, self._safety
        return {
            "applied_pwm": safety.applied,
            "pwm_limit": self._rules.limits.magnitude,
            "slew_per_s": self._rules.limits.slew_per_s,
            "stopped": int(safety.stop.latched),
            "active": int(safety.active),
            "samples": wire.received,
            "samples_lost": timing.lost,
            "samples_old": self._old,
            "samples_unpublished": self._waiting.dropped,
            "samples_before_start": wire.late,
            "samples_refused": safety.counts.samples,
            "packets_malformed": wire.malformed,
            "packets_foreign": wire.foreign,
            "waits_in_vain": wire.lost,
            "encoder_spikes": safety.encoders.spikes,
            "clock_set_back": timing.set_back,
            "commands": self._commands,
            "commands_refused": safety.counts.commands,
            "commands_dropped_by_stop": safety.stop.dropped,
            "commands_dropped_by_reset": safety.counts.during_reset,
            "commands_dropped_two_writers": safety.counts.of_two_writers,
            "commands_dropped_standstill": safety.counts.after_standstill,
            "commands_dropped_inactive": safety.counts.while_inactive,
            "commands_unsent": self._unsent,
            "resets": self._resets,
            "last_word_replaced": self._last_word.replaced,
            **self._sample_latency.summarize("sample_to_topic"),
            **self._command_latency.summarize("command_to_rig"),
        }

    def _publish_next(self) -> list[Arrival]:
        """Publish the sample that has waited longest, or the next to come; return what came."""
        oldest = self._waiting.take_oldest()
        if oldest is not None:
            self._publish(oldest)
            return []
        arrival = self._link.receive_stamped(time.monotonic() + WAIT_S)
        if arrival is None:
            return []
        self._publish(arrival)
        return [arrival]

    def _publish(self, arrival: Arrival) -> None:
        self._outlet.publish_sample(read_state(arrival), self._clock.stamp(arrival.arrival_ns))
        with self._lock:
            self._sample_latency.add(1e-9 * (time.time_ns() - arrival.arrival_ns))

    def _decide(self, sample: RigState | None, ago_s: float = 0.0, skipped: int = 0) -> None:
        if self._closed:
            return
        now_s = self._now()
        self._standstill_s = max(self._standstill_s, now_s - self._decided_s)
        safety = events.note_last_word(self._safety, self._last_word.fault)
        decision = decide(None, sample, now_s, safety, self._rules, ago_s, skipped)
        ended = decision.reset_ended
        if self._now() - now_s > events.STANDSTILL_S:  # the process was stopped (SIGSTOP)
            decision = decide(None, None, self._now(), decision.safety, self._rules)
        self._safety, self._decided_s = decision.safety, self._now()
        self._standstill_s = max(self._standstill_s, self._decided_s - now_s)
        self._send(decision.pwm)
        self._note(max(decision.reasons, key=lambda reason: reason.level, default=None))
        self._end_reset(ended or decision.reset_ended)

    def _send_zero(self) -> None:
        if not self._closed:
            with suppress(Exception):  # the caller has to go on, whatever else is broken
                self._send(0.0)

    def _send(self, pwm: float) -> None:
        try:
            self._link.send(Command(pwm))
        except BadInputError as error:
            self._fault = str(error)
            self._unsent += 1
        else:
            self._out_pwm = pwm
            self._outlet.publish_applied(pwm)

    def _note(self, reason: Reason | None) -> None:
        self._worst = pick_worse(self._worst, reason)

    def _end_reset(self, ended: Reason | None) -> None:
        if ended is None:
            return
        listeners, self._listeners = self._listeners, []
        self._resets += bool(listeners)
        self._note(ended)
        for listener in listeners:
            listener(ended)


def read_state(arrival: Arrival) -> RigState:
    """Return the state that a sample shows."""
    sample = arrival.sample
    return RigState(sample.cart_m, sample.pole_rad, sample.cart_velocity, sample.pole_rate)
