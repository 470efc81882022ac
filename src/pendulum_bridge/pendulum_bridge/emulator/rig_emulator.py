"""An emulated rig: MuJoCo behind the rig's own protocol, over UDP or TCP, with concealed physics.

It sends a sample at every sampling time and holds the last command for ever, as the real rig does.
It holds the command even when a TCP connection closes: an emulator that stopped by itself would
hide a driver that fails to stop the rig.
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
from contextlib import closing
from pathlib import Path

from pendulum_bridge.emulator.conceal import draw_concealed
from pendulum_bridge.emulator.concealable import BY_NAME
from pendulum_bridge.emulator.live_rig import LiveRig
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import Concealed, write_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.server import Ended, Served, serve_in_lockstep, serve_in_time
from pendulum_bridge.emulator.tcp_server import TcpServer
from pendulum_bridge.wire.port import Port
from pendulum_bridge.wire.protocol import COMMAND, Command
from pendulum_bridge.wire.udp import RIG, USER, Endpoint, parse_address
from pendulum_twin.command_line import (
    as_option,
    make_number_reader,
    make_whole_reader,
)
from pendulum_twin.errors import BadInputError
from pendulum_twin.inteco import DEFAULT, load_twin_or_inteco
from pendulum_twin.parser import Parser, add_common_options, complete
from pendulum_twin.stop_request import StopRequest, catch_stop_signals, ignore_stop_signals


def main(arguments: list[str] | None = None) -> int:
    """Serve until SIGINT, SIGTERM or the end of --seconds and return 0.

    Returns 1 with a sentence on stderr when the rig cannot be served; exits with 2 for wrong use.
    """
    stopped = catch_stop_signals()
    options = parse_options(arguments)
    try:
        run(options, stopped)
    except (BadInputError, OSError) as error:
        print(f"rig_emulator: {error}", file=sys.stderr)
        return 1
    finally:
        if arguments is None:  # the program ends: a second Ctrl-C must not change how
            ignore_stop_signals()
    return 0


def run(options: argparse.Namespace, stopped: StopRequest) -> None:
    """Serve as the options say until `stopped` is set.

    Raises BadInputError or OSError when the rig cannot be served.
    """
    concealed = _choose_concealed(options)
    rig = LiveRig(
        concealed, options.rate, Encoders(spike_rate=options.spikes), options.conceal or 0
    )
    if options.then is not None:
        changed = _read_rig(options.then)
        EmulatedRig(changed, options.rate)  # refuses now what cannot be emulated
        signal.signal(signal.SIGUSR1, lambda *_: rig.change(changed))
    with closing(_open_port(options)) as port:
        if options.seal:
            write_seal(concealed, options.seal)
        where = "answers there over TCP" if options.tcp else f"sends to {options.send}"
        pace = (
            "in lockstep"
            if options.lockstep
            else f"{options.rate:g} Hz, {options.speed:g} times real time"
        )
        tell = _ignore if options.quiet else _say
        tell(f"rig_emulator: listens on {options.listen}, {where}, {pace}")
        served = _serve(rig, port, options, _make_end_check(stopped, options.seconds))
        tell(_summarise(served, port))


def _open_port(options: argparse.Namespace) -> Port[Command]:
    if options.tcp:
        return TcpServer(options.listen, COMMAND.size, Command.unpack)
    return Endpoint(options.listen, options.send, Command.unpack)


def _serve(rig: LiveRig, port: Port[Command], options: argparse.Namespace, ended: Ended) -> Served:
    if options.lockstep:
        return serve_in_lockstep(rig, port, ended)
    return serve_in_time(
        rig,
        port,
        options.speed,
        ended,
        lambda sentence: _say(f"rig_emulator: {sentence}"),
        options.at_once,
    )


def _summarise(served: Served, port: Port[Command]) -> str:
    behind = f"; fell {served.given_up_s:.1f} s behind" if served.given_up_s else ""
    return (
        f"rig_emulator: {served.samples} samples sent, {served.commands} commands taken, "
        f"{port.malformed} malformed and {port.foreign} foreign packets dropped{behind}"
    )


def _choose_concealed(options: argparse.Namespace) -> Concealed:
    """Return the rig that the seed draws, or, without a seed, the twin of the file."""
    if options.conceal is not None:
        nominal = load_twin_or_inteco(options.twin).rig
        return draw_concealed(options.conceal, options.effects, nominal, live=True)
    return _read_rig(options.twin)


def _read_rig(file: Path | None) -> Concealed:
    """Return the rig of a twin file; raise BadInputError when it cannot be emulated."""
    twin = load_twin_or_inteco(file)
    for name in twin.effects:
        if name not in BY_NAME:
            raise BadInputError(
                f"{file}: expected effects that can be emulated ({', '.join(BY_NAME)}), "
                f"found {name}"
            )
    return Concealed(twin.effects, twin.rig)


def _make_end_check(stopped: StopRequest, seconds: float | None) -> Ended:
    end = None if seconds is None else time.monotonic() + seconds
    return lambda: stopped.is_set() or (end is not None and time.monotonic() >= end)


def _ignore(line: str) -> None:
    """Ignore a line that --quiet leaves out."""


def _say(line: str) -> None:
    """Print a line at once; go on when the reader of stdout has gone."""
    try:
        print(line, flush=True)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def parse_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="rig_emulator",
        description=__doc__,
        examples=(
            "rig_emulator --twin config/inteco.yaml --conceal 13 --effects 2 --seal seal.json",
            "rig_emulator --twin rig.yaml --tcp --seconds 60",
            "rig_emulator --twin rig.yaml --then worn_rig.yaml",
        ),
    )
    add_common_options(parser)
    _add_rig(parser)
    _add_samples(parser)
    _add_pace(parser)
    _add_addresses(parser)
    complete(parser)
    options = parser.parse_args(arguments)
    if options.effects is not None and options.conceal is None:
        parser.error("--effects: expected --conceal SEED with it")
    if options.at_once and options.lockstep:
        parser.error("--at-once: expected a rig in real time, found --lockstep")
    options.effects = 1 if options.effects is None else options.effects
    return options


def _add_rig(parser: Parser) -> None:
    """Add what the rig is: the nominal rig, and what is concealed in it."""
    parser.add_argument(
        "--twin",
        type=Path,
        help=f"twin file of the nominal rig {DEFAULT}",
    )
    parser.add_argument(
        "--conceal",
        type=make_whole_reader(),
        metavar="SEED",
        help="conceal the effects and wrong parameters that this seed draws",
    )
    parser.add_argument(
        "--effects",
        type=make_whole_reader(),
        metavar="N",
        help="how many effects are concealed (default: 1)",
    )
    parser.add_argument(
        "--then",
        type=Path,
        metavar="FILE",
        help="twin file of the rig that this rig becomes, in motion, at SIGUSR1",
    )
    parser.add_argument(
        "--seal",
        type=Path,
        metavar="FILE",
        help="write what is concealed here, to be opened after the diagnosis",
    )


def _add_samples(parser: Parser) -> None:
    """Add what the samples are like."""
    parser.add_argument(
        "--rate",
        type=make_number_reader(10, 1000),
        default=100.0,
        metavar="HZ",
        help="samples a second",
    )
    parser.add_argument(
        "--spikes",
        type=make_number_reader(0, 1),
        default=0.0,
        metavar="SHARE",
        help="share of samples with a spike",
    )


def _add_pace(parser: Parser) -> None:
    """Add how fast the rig runs, and for how long."""
    pace = parser.add_mutually_exclusive_group()
    pace.add_argument(
        "--speed",
        type=make_number_reader(0.1, 1000),
        default=1.0,
        metavar="X",
        help="times real time",
    )
    pace.add_argument(
        "--lockstep",
        action="store_true",
        help="one command in, one sample out, as fast as it goes",
    )
    parser.add_argument(
        "--at-once",
        action="store_true",
        help="a command acts when it comes, as on an amplifier that is driven directly, and not "
        "from the nearest sample on",
    )
    parser.add_argument(
        "--seconds",
        type=make_number_reader(0, 1e9),
        metavar="S",
        help="end after so many seconds by the clock on the wall",
    )


def _add_addresses(parser: Parser) -> None:
    """Add where commands arrive, and where samples go."""
    parser.add_argument(
        "--listen",
        type=as_option(parse_address),
        default=RIG,
        metavar="HOST:PORT",
        help="where commands arrive",
    )
    way = parser.add_mutually_exclusive_group()
    way.add_argument(
        "--send",
        type=as_option(parse_address),
        default=USER,
        metavar="HOST:PORT",
        help="where samples go",
    )
    way.add_argument(
        "--tcp",
        action="store_true",
        help="send samples to the program that connects to --listen over TCP",
    )


if __name__ == "__main__":
    sys.exit(main())
