"""Faults of the driver's program, its parameters, and its services."""

import math
import os
import signal
import time
from pathlib import Path

from faults.bench import BUSY_S, Bench, driver_arguments
from faults.row import Row
from support.driven_rig import MODULE
from support.polling import until
from support.ros_graph import DEADLINE_S, Graph
from support.wire import Wire

from pendulum_bridge.driver.companion import ANSWER_S, PROGRAM
from pendulum_bridge.safety.reasons import Reason

AT_ONCE_S = 0.1
COMPANION_S = 0.25  # its patience, and a step
WRONG_LIVE = (
    ("pwm_limit", math.nan, "pwm_limit out of range Min: 0.001, Max: 1.0, value: nan"),
    ("pwm_limit", "a lot", "pwm_limit: expected a number"),
    ("pwm_limit", 99.0, "pwm_limit"),
    ("slew_per_s", -1.0, "slew_per_s"),
    ("slew_per_s", [1.0, 2.0], "slew_per_s: expected a number"),
    ("rate_hz", 50.0, "rate_hz"),
)
WRONG_AT_START = (
    ({"pwm_limit": ".nan"}, "pwm_limit: expected a number from 0.001 to 1, found nan"),
    ({"slew_per_s": "fast"}, "slew_per_s: expected a number, found 'fast'"),
    ({"rate_hz": 1e6}, "rate_hz: expected a number from 10 to 1000"),
)


def driver_killed(bench: Bench) -> Row:
    bench.driver.kill()
    begin = time.monotonic()
    bench.driver.communicate()
    zero_s = bench.zero_after(begin, AT_ONCE_S, bench.drive)
    bench.start_driver()
    bench.recovers()
    return Row(
        "SIGKILL of the driver", zero_s, "its companion sends PWM 0; a new driver drives on"
    )


def driver_stopped(bench: Bench) -> Row:
    old = 0.07
    bench.driver.send_signal(signal.SIGSTOP)
    begin = time.monotonic()
    try:
        zero_s = bench.zero_after(begin, COMPANION_S, lambda: bench.send(old))
        bench.spin(0.5, lambda: bench.send(old))
    finally:
        bench.driver.send_signal(signal.SIGCONT)
    resumed = time.monotonic()
    bench.spin(0.3)
    got = {sent.pwm for sent in bench.wire.since(resumed)}
    assert got == {0.0}, f"after the SIGCONT came {got}"
    bench.user.healths.clear()
    bench.recovers()
    right = (
        "its companion sends PWM 0; after SIGCONT no command of before comes through, new ones do"
    )
    return Row("SIGSTOP of the driver", zero_s, right)


def companion_killed(bench: Bench) -> Row:
    """Kill the process that has the last word, then the driver: the new one must speak."""
    os.kill(find_companion(bench), signal.SIGKILL)
    begin = time.monotonic()
    bench.until(
        lambda: any(sent.pwm == 0 for sent in bench.wire.since(begin)), "PWM 0", bench.drive
    )
    zero_s = next(sent.at_s for sent in bench.wire.since(begin) if sent.pwm == 0) - begin
    assert zero_s <= AT_ONCE_S + BUSY_S
    said = bench.said(Reason.NO_LAST_WORD, step=bench.drive)
    bench.recovers()
    assert bench.counted("last_word_replaced", bench.drive) == 1
    find_companion(bench)
    bench.driver.kill()
    killed = time.monotonic()
    bench.driver.communicate()
    bench.zero_after(killed, AT_ONCE_S, bench.drive)
    bench.start_driver()
    bench.recovers()
    right = "PWM 0 until a new one is ready; goes on; the new one speaks when the driver is killed"
    return Row("SIGKILL of the process that has the last word", zero_s, right, said)


def companion_stopped(bench: Bench) -> Row:
    """It would say nothing if the driver died now; nobody lets it go on."""
    os.kill(find_companion(bench), signal.SIGSTOP)
    begin = time.monotonic()
    zero_s = bench.zero_after(begin, ANSWER_S + AT_ONCE_S, bench.drive)
    said = bench.said(Reason.LAST_WORD_SILENT, step=bench.drive)
    bench.recovers()
    assert bench.counted("last_word_replaced", bench.drive) == 1
    right = "PWM 0; after 5 s another one takes its place, and the driver goes on"
    return Row("SIGSTOP of the process that has the last word", zero_s, right, said)


def find_companion(bench: Bench) -> int:
    """Return the number of the driver's companion process."""
    threads = Path(f"/proc/{bench.driver.pid}/task").glob("*/children")
    numbers = [int(number) for file in threads for number in file.read_text().split()]
    running = [n for n in numbers if PROGRAM.name in Path(f"/proc/{n}/cmdline").read_text()]
    assert len(running) == 1, f"expected one companion, found {running}"
    return running[0]


def wrong_parameters(bench: Bench) -> Row:
    begin = time.monotonic()
    said = ""
    for name, value, expected in WRONG_LIVE:
        said = bench.set(**{name: value})
        assert expected in said, f"{name} {value!r}: {said!r}"
        bench.spin(0.1, bench.drive)
    first = bench.set(**{WRONG_LIVE[0][0]: WRONG_LIVE[0][1]})
    bench.goes_on(begin, 0.3)
    return Row(
        "illegal parameters while it runs: NaN, text, range",
        None,
        "goes on; each is refused in a sentence",
        first,
    )


def wrong_at_start(ros: Graph) -> Row:
    wire = Wire()
    try:
        programs = [
            ros.start(MODULE, *driver_arguments(wire, **values)) for values, _ in WRONG_AT_START
        ]
        for program, (_, sentence) in zip(programs, WRONG_AT_START, strict=True):
            said, complaint = program.communicate(timeout=DEADLINE_S)
            assert (program.returncode, said) == (1, "") and complaint.count("\n") == 1
            assert complaint.startswith(f"driver_node: {sentence}"), complaint
        assert not wire.odd and all(sent.pwm == 0 for sent in wire.commands)
    finally:
        wire.close()
    return Row(
        "illegal parameters at the start",
        None,
        "ends with status 1 and a sentence; the rig gets no PWM",
        complaint,
    )


def stop(bench: Bench) -> Row:
    begin = time.monotonic()
    answer = bench.user.call("stop")
    zero_s = bench.zero_after(begin, AT_ONCE_S, bench.drive)
    said = bench.said(Reason.STOPPED, Reason.DROPPED, step=bench.drive)
    refused = bench.user.ask("clear_stop")  # a commander that falls silent meanwhile would be 0
    until(refused.done, "the answer of clear_stop", bench.drive)
    assert answer.success and refused.result().message == Reason.ZERO_FIRST.sentence
    bench.clear()
    bench.recovers()
    return Row(
        "emergency stop", zero_s, "PWM 0; stays until it is cleared after a command of 0", said
    )


def stop_in_reset(bench: Bench) -> Row:
    asked = time.monotonic()
    pending = bench.user.ask("reset")
    bench.until(
        lambda: any(abs(sent.pwm) not in (0.0, 0.1) for sent in bench.wire.since(asked)),
        "the reset to drive",
    )
    begin = time.monotonic()
    assert bench.user.call("stop").success
    zero_s = bench.zero_after(begin, AT_ONCE_S)
    bench.until(pending.done, "the answer")
    assert pending.result().message == Reason.RESET_STOPPED.sentence
    bench.clear()
    bench.recovers()
    return Row(
        "stop during a reset",
        zero_s,
        "PWM 0; the reset is given up and answered",
        pending.result().message,
    )
