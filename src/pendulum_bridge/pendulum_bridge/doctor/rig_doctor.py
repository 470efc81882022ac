"""Find out why a rig does not connect, or whether it does: ports, samples, rate, rest, zeros, signs, limits, reset.

Each check ends in one line: OK, WARN, FAIL or SKIPPED, what was expected, what was found, and what
to do. The rig is sent PWM 0 and nothing else, unless --move allows to move the cart; PWM 0 is also
the last thing that is sent.
"""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from pendulum_bridge.doctor.driving import stop
from pendulum_bridge.doctor.examination import Task, examine
from pendulum_bridge.doctor.faults import Verdict
from pendulum_bridge.doctor.findings import Check, Finding, skipped
from pendulum_bridge.doctor.ports import (
    check_address,
    check_rig_port,
    our_port_open,
    our_port_refused,
)
from pendulum_bridge.doctor.wire import PortWire, tcp_wire, udp_wire
from pendulum_bridge.wire.udp import RIG, USER, Address, address_of
from pendulum_twin.command_line import as_option, make_number_reader
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin

SCHEMA = "rig_doctor/1"
NOTICE = (
    "rig_doctor: --move: the cart will be pushed gently both ways, up to some 0.3 m, and the rig's own swing-down be asked "
    "for. Keep clear of it; Ctrl-C stops it."
)


def main(arguments: list[str] | None = None) -> int:
    """Examine a rig and print each finding as it is made; return 0 when nothing FAILed, 1 when something did.

    Ends with 2 for wrong use; returns 1 with a sentence on stderr when it was interrupted or
    cannot be done.
    """
    options = options_of(arguments)
    signal.signal(signal.SIGTERM, _interrupted)
    findings: list[Finding] = []
    try:
        task = Task(load_twin(options.twin), options.rate, options.seconds, options.move)
        if options.move:
            print(NOTICE, file=sys.stderr, flush=True)
        with closing(examined(options, task)) as coming:
            for finding in coming:
                findings.append(finding)
                if not options.json:
                    print(finding.line, flush=True)
    except BadInputError as error:
        return _ended(f"rig_doctor: {error}")
    except KeyboardInterrupt:
        return _ended("rig_doctor: interrupted; the last that was sent is PWM 0")
    except BrokenPipeError:
        return 1  # nobody reads any more
    print(json.dumps(_mapping(findings), indent=2) if options.json else f"\n{_summary(findings)}")
    return int(any(each.verdict is Verdict.FAIL for each in findings))


def examined(options: argparse.Namespace, task: Task) -> Generator[Finding]:
    """Yield all findings in the order of the checks."""
    address = check_address(None if options.tcp else options.listen, options.rig)
    yield address
    if address.verdict is Verdict.FAIL:
        yield from _rest_of(address, "the addresses cannot work")
    elif options.tcp:
        yield skipped(Check.OUR_PORT, "over TCP only the rig listens")
        yield skipped(Check.RIG_PORT, "over TCP the connection shows whether it does")
        yield from _with(tcp_wire(options.rig), task)
    else:
        yield from _over_udp(options.listen, options.rig, task)


def _over_udp(listen: Address, rig: Address, task: Task) -> Iterator[Finding]:
    """Yield the findings from our port on. While somebody else has it, the rig is theirs, and is sent nothing."""
    try:
        wire = udp_wire(listen, rig)
    except BadInputError as error:
        refused = our_port_refused(listen, error)
        yield refused
        yield from _rest_of(refused, "nothing can be heard without our port")
        return
    yield our_port_open(listen)
    yield from _with(wire, task, lambda: check_rig_port(rig))


def _with(
    wire: PortWire, task: Task, first: Callable[[], Finding] | None = None
) -> Iterator[Finding]:
    """Yield the findings of a wire, which gets PWM 0 at the end, whatever happens, and is closed."""
    try:
        if first is not None:
            yield first()
        yield from examine(wire, task)
    finally:
        with _undisturbed(), suppress(BadInputError):  # no way there: the findings say so
            stop(wire)
        wire.close()


def _rest_of(last: Finding, why: str) -> Iterator[Finding]:
    checks = list(Check)
    return (skipped(check, why) for check in checks[checks.index(last.check) + 1 :])


def _summary(findings: list[Finding]) -> str:
    counts = Counter(each.verdict for each in findings)
    return "rig_doctor: " + ", ".join(f"{counts[verdict]} {verdict.name}" for verdict in Verdict)


def _mapping(findings: list[Finding]) -> dict[str, object]:
    verdicts = {each.verdict for each in findings}
    worst = next((each for each in (Verdict.FAIL, Verdict.WARN) if each in verdicts), Verdict.OK)
    return {
        "schema": SCHEMA,
        "outcome": worst.name,
        "findings": [each.to_mapping() for each in findings],
    }


def _ended(sentence: str) -> int:
    print(sentence, file=sys.stderr)
    return 1


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Have the last words said to the end: who presses Ctrl-C twice is heard afterwards."""
    before = {
        number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupted(*_: object) -> None:
    raise KeyboardInterrupt


def options_of(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print what is wrong and exit with 2 for wrong use."""
    parser = argparse.ArgumentParser(prog="rig_doctor", description=__doc__)
    add = parser.add_argument
    add(
        "--twin",
        type=Path,
        default=Path("config/inteco.yaml"),
        help="twin file of the rig (config/inteco.yaml)",
    )
    add(
        "--listen",
        type=as_option(address_of),
        default=USER,
        metavar="HOST:PORT",
        help=f"where the rig sends its samples ({USER})",
    )
    add(
        "--rig",
        type=as_option(address_of),
        default=RIG,
        metavar="HOST:PORT",
        help=f"where the rig listens ({RIG})",
    )
    add(
        "--rate",
        type=make_number_reader(10, 1000),
        default=100.0,
        metavar="HZ",
        help="samples a second (100)",
    )
    add(
        "--seconds",
        type=make_number_reader(1, 600),
        default=3.0,
        metavar="S",
        help="how long to listen (3)",
    )
    add(
        "--move",
        action="store_true",
        help="allow to move the cart, gently, both ways: only so signs and limits show",
    )
    add("--tcp", action="store_true", help="connect to --rig over TCP instead of UDP")
    add("--json", action="store_true", help="print one JSON object at the end, instead of lines")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
