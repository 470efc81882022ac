"""Run the study of the decisions on kept trials.

The folder of `--trials` holds trials as `sysid prove` leaves them. What was tried is kept in a
file, so that a run that was interrupted goes on from there; delete the file (`--kept`) to start
anew.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path

from pendulum_sysid.studies.ablation.decision_list import list_decisions
from pendulum_sysid.studies.ablation.table import (
    list_idle,
    read_page,
    render_tables,
    write_page,
)
from pendulum_sysid.studies.ablation.variation import read_tried, vary_decisions
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.parser import Parser, add_common_options, complete

# Of the proof with seed 1: every kind twice, every outcome; hard trials are 14, 45 (three effects)
# and 4, 44 (not in the catalogue), and 46 has the friction of a real rig.
TRIALS = (2, 11, 6, 46, 38, 12, 45, 14, 4, 44)


def main(arguments: Sequence[str] | None = None) -> int:
    """Vary decisions on the chosen trials, write the tables, and print what changes nothing."""
    given = parse_arguments(arguments)
    saved = f"{given.kept} holds what was tried: run the same command again to go on from there"
    return run_command("ablation", lambda: _vary(given), saved)


def _vary(given: argparse.Namespace) -> int:
    read_page(given.out)  # before the work: a page without marks is refused
    listed = list_decisions()
    chosen = [d for d in listed if not given.only or d.name in given.only]
    folders = [given.trials / f"trial_{number:04d}" for number in given.numbers]
    given.kept.parent.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(given.processes) as pool:
        futures = {pool.submit(vary_decisions, f, chosen, given.kept): f for f in folders}
        for future in as_completed(futures):
            future.result()
            if not given.quiet:
                print(f"{futures[future].name} done", file=sys.stderr, flush=True)
            write_page(given.out, render_tables(listed, read_tried(given.kept)))
    idle = list_idle(chosen, read_tried(given.kept))
    print(f"{given.out}: {len(chosen)} decisions, {len(idle)} of them change no verdict")
    print("\n".join(idle))
    return 0


def parse_arguments(arguments: Sequence[str] | None) -> argparse.Namespace:
    """Return the options of the command line."""
    parser = Parser(
        prog="ablation",
        description=__doc__,
        examples=(
            "python -m pendulum_sysid.studies.ablation --trials out/proof --out docs/decisions.md",
        ),
    )
    add_common_options(parser)
    parser.add_argument("--trials", type=Path, required=True, help="folder of kept trials")
    parser.add_argument(
        "--out", type=Path, required=True, help="the page of the tables, in Markdown"
    )
    kept = Path("out/ablation.jsonl")
    parser.add_argument("--kept", type=Path, default=kept, help="what was tried")
    whole = make_whole_reader()
    parser.add_argument("--numbers", type=whole, nargs="+", default=TRIALS, help="of the trials")
    parser.add_argument("--only", nargs="+", default=(), help="decisions to vary (default: all)")
    parser.add_argument("--processes", type=make_whole_reader(1), default=2, help="side by side")
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
