"""Cut a piece out of a recording, without reported velocities."""

import math
import sys
from collections.abc import Sequence

import numpy as np
from program_options import make_parser

from pendulum_sysid.reading.bag import read_bag, write_bag
from pendulum_twin.command_line import make_number_reader, run_command


def cut(bag: str, out: str, begin: float, end: float) -> None:
    """Write the samples and commands from begin to end, s from the start of the recording."""
    raw = read_bag(bag)
    rows, sent = (
        (stamps >= begin) & (stamps < end) for stamps in (raw.state_stamp_s, raw.command_stamp_s)
    )
    stamps_ns, times_ns = (
        np.rint((stamps - begin) * 1e9).astype(np.int64)
        for stamps in (raw.state_stamp_s[rows], raw.command_stamp_s[sent])
    )
    joints = {
        name: values[rows]
        for name, values in (("cart", raw.cart), ("pole", raw.pole))
        if values is not None
    }
    write_bag(
        out,
        stamps_ns,
        joints,
        raw.command[sent] if np.any(sent) else None,
        command_times_ns=times_ns,
    )


def main(arguments: Sequence[str] | None = None) -> int:
    """Cut the piece that the command line says; return the exit status."""
    parser = make_parser("cut_recording", __doc__, "out/minute out/half 0 30")
    add, seconds = parser.add_argument, make_number_reader(0.0, math.inf)
    add("bag", metavar="BAG", help="the recording")
    add("out", metavar="OUT", help="folder of the recording to write")
    add("begin", type=seconds, metavar="BEGIN", help="first time, s from the recording's start")
    add("end", type=seconds, metavar="END", help="time that the piece ends before, s")
    given = parser.parse_args(arguments)
    if given.end <= given.begin:
        parser.error(f"expected END after BEGIN, found {given.begin:g} and {given.end:g}")
    piece = (given.bag, given.out, given.begin, given.end)
    return run_command("cut_recording", lambda: cut(*piece), "OUT may be half written")


if __name__ == "__main__":
    sys.exit(main())
