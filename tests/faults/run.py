"""Make every fault in turn and print the table: fault, time until PWM 0, what is right."""

import sys
from argparse import ArgumentParser
from collections.abc import Callable
from contextlib import closing
from functools import partial
from pathlib import Path

sys.path[0] = str(Path(__file__).parents[1])

from faults import apart, catalogue  # noqa: E402
from faults.bench import Bench  # noqa: E402
from faults.row import Row, head, line  # noqa: E402
from support.ros_graph import graph  # noqa: E402


def main() -> int:
    """Print a line a fault, and return 1 when the wrong thing happened at one of them."""
    parser = ArgumentParser(description=__doc__)
    parser.add_argument(
        "--only", default="", metavar="WORD", help="faults whose function's name holds this"
    )
    parser.add_argument(
        "--resets", type=int, default=1000, metavar="N", help="resets in a row (1000)"
    )
    options = parser.parse_args()
    wanted = partial(filter, lambda fault: options.only in fault.__name__)
    print(head(), flush=True)
    failed = 0
    if on_bench := list(wanted(catalogue.ON_BENCH)):
        with graph() as ros, closing(Bench(ros)) as bench:
            for fault in on_bench:
                failed += not shown(
                    fault.__name__, lambda fault=fault: bench.ready() or fault(bench)
                )
    for fault in wanted(catalogue.APART):
        with graph() as ros:
            more = {"count": options.resets} if fault is apart.resets else {}
            failed += not shown(
                fault.__name__, lambda fault=fault, ros=ros, more=more: fault(ros, **more)
            )
    if options.only in apart.system_clock_jumps.__name__:
        failed += not shown("system_clock_jumps", apart.system_clock_jumps)
    return int(failed > 0)


def shown(name: str, fault: Callable[[], Row]) -> bool:
    """Print what came of a fault; tell whether it was right."""
    try:
        print(line(fault().cells), flush=True)
    except AssertionError as error:
        print(line((name, "", f"**WRONG**: {error}", "")), flush=True)
        return False
    return True


if __name__ == "__main__":
    sys.exit(main())
