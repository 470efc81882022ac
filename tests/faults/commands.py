"""Faults of who commands."""

import math
import signal
import time
from itertools import pairwise

from faults.bench import BUSY_S, PUSH, Bench
from faults.row import Row
from std_msgs.msg import Float64

from pendulum_bridge.driver.driver import DECISIONS_BETWEEN, WAIT_S
from pendulum_bridge.safety.reasons import Reason
from pendulum_bridge.safety.two_writers import TOGETHER_S

TIMEOUT_S = 0.2
QUIET_S = TOGETHER_S + 0.1  # of the bench's own user, before another one commands


def stale_command(bench: Bench) -> Row:
    begin = time.monotonic()
    zero_s = bench.zero_after(begin, TIMEOUT_S)
    said = bench.said(Reason.COMMAND_OLD)
    bench.recovers()
    return Row(
        "stale command: the user stops commanding",
        zero_s,
        "PWM 0 after 0.2 s; the next command counts",
        said,
    )


def learner_pauses(bench: Bench) -> Row:
    bench.spin(QUIET_S)
    learner = bench.commander(100, PUSH)
    bench.until(lambda: bench.wire.pwm != 0, "the learner's commands")
    bench.spin(0.3)
    learner.send_signal(signal.SIGSTOP)
    begin = time.monotonic()
    bench.user.healths.clear()
    zero_s = bench.zero_after(begin, TIMEOUT_S)
    said = bench.said(Reason.COMMAND_OLD)
    learner.send_signal(signal.SIGCONT)
    bench.until(lambda: bench.wire.pwm != 0, "the learner once more")
    learner.kill()
    bench.recovers()
    return Row(
        "learner pauses: SIGSTOP of the program that commands",
        zero_s,
        "PWM 0; goes on after SIGCONT",
        said,
    )


def flood(bench: Bench, rate_hz: float = 10_000.0, seconds: float = 2.0) -> Row:
    limit, slew_per_s = 0.08, 0.8  # 0.1 s one way at this rate is all that the commands leave it
    bench.spin(QUIET_S)
    assert bench.set(pwm_limit=limit, slew_per_s=slew_per_s) == ""
    try:
        flooder = bench.commander(rate_hz, 1.0)
        bench.until(lambda: bench.wire.pwm != 0, "the flood")
        begin, before = time.monotonic(), len(bench.user.states)
        sent = bench.goes_on(begin, seconds, bench.idle)
        passed_s, samples = time.monotonic() - begin, len(bench.user.states) - before
        assert samples > 50 * passed_s, f"{samples} samples in {passed_s:.1f} s"
        most = (DECISIONS_BETWEEN + 1) * 100 * passed_s + passed_s / WAIT_S + 50
        assert len(sent) < most, f"{len(sent)} packets, at most {most:.0f}"
        moved = sum(abs(b.pwm - a.pwm) for a, b in pairwise(sent))
        assert max(abs(command.pwm) for command in sent) <= limit
        assert moved <= slew_per_s * (passed_s + BUSY_S), (
            f"PWM moved by {moved:.2f} in {passed_s:.1f} s"
        )
        flooder.kill()
        end = time.monotonic()
        zero_s = bench.zero_after(end, TIMEOUT_S)
        printed = flooder.communicate()[0].split()
    finally:
        assert bench.set(pwm_limit=0.5, slew_per_s=50.0) == ""
    bench.spin(QUIET_S)
    flood_hz, packets_hz = float(printed[-2]) / float(printed[-1]), len(sent) / passed_s
    right = (
        f"of {flood_hz:.0f} commands a second {packets_hz:.0f} reach the rig, within limit and "
        "slew a second, "
        f"beside {samples / passed_s:.0f} samples; PWM 0 after it ends"
    )
    said = bench.said(Reason.COMMAND_OLD)
    bench.recovers()
    return Row("flood of commands at 10 kHz", zero_s, right, said)


def no_number(bench: Bench, value: float) -> Row:
    begin = time.monotonic()
    zero_s = bench.zero_after(begin, TIMEOUT_S, lambda: bench.send(value))
    said = bench.said(
        Reason.COMMAND_OLD, Reason.COMMAND_NOT_FINITE, step=lambda: bench.send(value)
    )
    refused = bench.counted("commands_refused")
    assert refused > 10 and not bench.wire.odd
    bench.recovers()
    return Row(
        f"command {value}",
        zero_s,
        "none reaches the rig, each is counted; the last good one counts for 0.2 s",
        said,
    )


def not_a_number(bench: Bench) -> Row:
    return no_number(bench, math.nan)


def infinity(bench: Bench) -> Row:
    return no_number(bench, math.inf)


def huge(bench: Bench) -> Row:
    limit = 0.15
    assert bench.set(pwm_limit=limit) == ""
    try:
        begin = time.monotonic()
        sent = bench.goes_on(begin, step=lambda: bench.send(bench.wave(1e300)))
        assert max(abs(command.pwm) for command in sent) <= limit
        bench.user.healths.clear()
        said = bench.said(Reason.OVER_LIMIT, step=lambda: bench.send(bench.wave(1e300)))
    finally:
        assert bench.set(pwm_limit=0.5) == ""
    bench.recovers()
    return Row("command 1e300", None, f"goes on, clipped to pwm_limit ({limit} here)", said)


def two_writers(bench: Bench) -> Row:
    node = bench.ros.user("other")
    other = node.create_publisher(Float64, "pwm", 1)
    bench.until(other.get_subscription_count, "discovery", bench.drive)
    bench.spin(0.1, bench.drive)
    due = begin = time.monotonic()

    def both() -> None:
        nonlocal due
        if (now := time.monotonic()) >= due:
            other.publish(Float64(data=-PUSH))
            due = now + 0.01
        bench.drive()

    zero_s = bench.zero_after(begin, 0.1, both)
    said = bench.said(Reason.TWO_WRITERS, step=both)
    bench.ros.remove(node)
    end = time.monotonic()
    bench.recovers()
    first = next(sent for sent in bench.wire.since(end) if sent.pwm != 0)
    assert first.at_s - end > TOGETHER_S - BUSY_S / 2
    return Row("two writers on pwm", zero_s, "PWM 0 until one has been silent for 0.5 s", said)
