"""Examine the connection to a rig: ports, samples, rate, rest, zeros, signs, limits, reset.

Each check prints a line: OK, WARN, FAIL or SKIPPED, what was expected, what was found, and what to
do. The rig is sent PWM 0 only, unless --move allows to move the cart; the last command is PWM 0 in
any case.
"""

from __future__ import annotations

import argparse
import json
import os
import signal
import sys
from collections import Counter
from collections.abc import Callable, Generator, Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from pendulum_bridge.doctor.driving import stop
from pendulum_bridge.doctor.examination import Task, examine
from pendulum_bridge.doctor.faults import Verdict
from pendulum_bridge.doctor.findings import Check, Finding, skip_check
from pendulum_bridge.doctor.ports import (
    check_address,
    check_rig_port,
    report_port_open,
    report_port_refused,
)
from pendulum_bridge.doctor.wire import PortWire, open_tcp_wire, open_udp_wire
from pendulum_bridge.wire.udp import RIG, USER, Address, parse_address
from pendulum_twin.command_line import as_option, make_number_reader
from pendulum_twin.errors import BadInputError
from pendulum_twin.inteco import DEFAULT, load_twin_or_inteco
from pendulum_twin.parser import Parser, add_common_options, complete
from pendulum_twin.schemas import DOCTOR

GOOD = (Verdict.OK, Verdict.SKIPPED)  # what --quiet leaves out
NOTICE = (
    "rig_doctor: --move: the cart will be pushed gently both ways, up to some 0.3 m, and the "
    "rig's own swing-down be asked for. Keep clear of it; Ctrl-C stops it."
)


def main(arguments: list[str] | None = None) -> int:
    """Examine a rig and print each finding; return 0 without a FAIL, 1 with a FAIL.

    Exits with 2 for wrong use; returns 1 with a sentence on stderr when the examination was
    interrupted or cannot be done.
    """
    options = parse_options(arguments)
    signal.signal(signal.SIGTERM, _interrupt)
    findings: list[Finding] = []
    try:
        task = Task(load_twin_or_inteco(options.twin), options.rate, options.seconds, options.move)
        if options.move:
            print(NOTICE, file=sys.stderr, flush=True)
        with closing(run_checks(options, task)) as checks:
            for finding in checks:
                findings.append(finding)
                if not (options.json or (options.quiet and finding.verdict in GOOD)):
                    print(finding.line, flush=True)
        end = (
            json.dumps(_make_mapping(findings), indent=2)
            if options.json
            else f"\n{_summarise(findings)}"
        )
        print(end, flush=True)
    except BadInputError as error:
        return _report_failure(f"rig_doctor: {error}")
    except KeyboardInterrupt:
        return _report_failure("rig_doctor: interrupted; the last that was sent is PWM 0")
    except BrokenPipeError:  # the reader of stdout has gone; Python would complain at the exit
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    return int(any(finding.verdict is Verdict.FAIL for finding in findings))


def run_checks(options: argparse.Namespace, task: Task) -> Generator[Finding]:
    """Yield all findings, in the order of the checks."""
    address = check_address(None if options.tcp else options.listen, options.rig)
    yield address
    if address.verdict is Verdict.FAIL:
        yield from _skip_after(address, "the addresses cannot work")
    elif options.tcp:
        yield skip_check(Check.OUR_PORT, "over TCP only the rig listens")
        yield skip_check(Check.RIG_PORT, "over TCP the connection shows whether it does")
        yield from _check_wire(open_tcp_wire(options.rig), task)
    else:
        yield from _check_over_udp(options.listen, options.rig, task)


def _check_over_udp(listen: Address, rig: Address, task: Task) -> Iterator[Finding]:
    """Yield the findings from our port on; send nothing while another program has the port."""
    try:
        wire = open_udp_wire(listen, rig)
    except BadInputError as error:
        refused = report_port_refused(listen, error)
        yield refused
        yield from _skip_after(refused, "nothing can be heard without our port")
        return
    yield report_port_open(listen)
    yield from _check_wire(wire, task, lambda: check_rig_port(rig))


def _check_wire(
    wire: PortWire, task: Task, first: Callable[[], Finding] | None = None
) -> Iterator[Finding]:
    """Yield the findings of a wire; whatever happens, send PWM 0 at the end and close it.

    first: a check that comes before.

    Raises BadInputError when the network refuses a command, or every PWM 0 at the end.
    """
    try:
        if task.may_move:
            wire.keep_last_word()
        if first is not None:
            yield first()
        yield from examine(wire, task)
    finally:
        with _ignore_signals(), suppress(BadInputError):  # without a way to the rig: see findings
            stop(wire)
        wire.close()


def _skip_after(last: Finding, reason: str) -> Iterator[Finding]:
    checks = list(Check)
    return (skip_check(check, reason) for check in checks[checks.index(last.check) + 1 :])


def _summarise(findings: list[Finding]) -> str:
    counts = Counter(finding.verdict for finding in findings)
    return "rig_doctor: " + ", ".join(f"{counts[verdict]} {verdict.name}" for verdict in Verdict)


def _make_mapping(findings: list[Finding]) -> dict[str, object]:
    verdicts = {finding.verdict for finding in findings}
    worst = next((v for v in (Verdict.FAIL, Verdict.WARN) if v in verdicts), Verdict.OK)
    return {
        "schema": DOCTOR,
        "outcome": worst.name,
        "findings": [finding.to_mapping() for finding in findings],
    }


def _report_failure(sentence: str) -> int:
    print(sentence, file=sys.stderr)
    return 1


@contextmanager
def _ignore_signals() -> Iterator[None]:
    """Hold back SIGINT and SIGTERM, so that the last packets are sent."""
    before = {
        number: signal.signal(number, signal.SIG_IGN) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _interrupt(*_: object) -> None:
    raise KeyboardInterrupt


def parse_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="rig_doctor",
        description=__doc__,
        examples=(
            "rig_doctor --twin config/inteco.yaml",
            "rig_doctor --twin rig.yaml --rig 192.168.1.7:16384 --listen 0.0.0.0:16385 --move",
            "rig_doctor --twin rig.yaml --json > examination.json",
        ),
    )
    add_common_options(parser)
    add = parser.add_argument
    add(
        "--twin",
        type=Path,
        help=f"twin file of the rig {DEFAULT}",
    )
    add(
        "--listen",
        type=as_option(parse_address),
        default=USER,
        metavar="HOST:PORT",
        help="where the rig sends its samples",
    )
    add(
        "--rig",
        type=as_option(parse_address),
        default=RIG,
        metavar="HOST:PORT",
        help="where the rig listens",
    )
    add(
        "--rate",
        type=make_number_reader(10, 1000),
        default=100.0,
        metavar="HZ",
        help="samples a second",
    )
    add(
        "--seconds",
        type=make_number_reader(1, 600),
        default=3.0,
        metavar="S",
        help="how long to listen",
    )
    add(
        "--move",
        action="store_true",
        help="allow to move the cart, gently, both ways: only this shows signs and limits",
    )
    add("--tcp", action="store_true", help="connect to --rig over TCP instead of UDP")
    add("--json", action="store_true", help="print one JSON object at the end, instead of lines")
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
