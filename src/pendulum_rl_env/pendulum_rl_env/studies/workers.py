"""Run studies on the engine of the fleet, and the command lines of other packages within them.

A study imports the command lines of other packages and calls them where its task runs: a worker of
one thread, so that what a program prints stays apart from the study's own output.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Callable, Iterable, Sequence
from contextlib import redirect_stderr, redirect_stdout
from functools import partial
from typing import Any

from pendulum_sysid.fleet.engine import Engine, open_client, run_tasks
from pendulum_twin.command_line import make_whole_reader
from pendulum_twin.errors import BadInputError

QUOTED_LINES = 3  # of what a program wrote on stderr, in the message of its failure
MEMORY_BYTES = 6_000_000_000  # of a local worker: torch takes its share
TASK_LIMIT_S = 7 * 86_400.0  # a rig with all its trainings takes hours

Main = Callable[[list[str]], int]


def add_engine_options(parser: argparse.ArgumentParser, what: str) -> None:
    """Add where a study's tasks run; `what` says what is done side by side."""
    parser.add_argument(
        "--processes",
        "--workers",
        dest="workers",
        type=make_whole_reader(1),
        default=2,
        metavar="P",
        help=f"{what} at a time",
    )
    address = "address of a Dask cluster in place of a local one; it shares the folder"
    parser.add_argument("--scheduler", metavar="ADDRESS", help=address)


def run_study[Item, Result](
    function: Callable[[Item], Result],
    items: Iterable[Item],
    options: argparse.Namespace,
    report: Callable[[Item, Result], None] = lambda item, result: None,
) -> list[Result]:
    """Return the function's results, in the order of the items.

    options: with `workers` and `scheduler`.
    report: is called as each item ends.
    Raises BadInputError, after all others have ended, when an item raised one or ended its worker.
    """
    listed = list(items)
    engine = Engine(options.workers, options.scheduler, MEMORY_BYTES, TASK_LIMIT_S)
    results: dict[int, Result] = {}
    failures: list[BaseException] = []
    with open_client(engine) as client:
        numbered = list(enumerate(listed))
        for ending in run_tasks(client, partial(_run_numbered, function), numbered, TASK_LIMIT_S):
            number, item = ending.item
            if ending.error is not None:
                failures.append(ending.error)
            elif ending.put_aside:
                failures.append(BadInputError(f"a task could not be done: {ending.put_aside}"))
            else:
                results[number] = ending.result  # type: ignore[assignment]
                report(item, results[number])
    if failures:
        raise failures[0]
    return [results[number] for number in range(len(listed))]


def _run_numbered(function: Callable[[Any], Any], pair: tuple[int, Any]) -> Any:
    return function(pair[1])


def run_program(name: str, main: Main, arguments: Sequence[str]) -> None:
    """Run a command line and return when it succeeded.

    name: of the program, for the message.
    main: its function.
    arguments: of the command line.

    Raises BadInputError with the end of what it wrote on stderr when it failed.
    """
    stderr = io.StringIO()
    status: int | str | None
    with redirect_stdout(io.StringIO()), redirect_stderr(stderr):
        try:
            status = main(list(arguments))
        except SystemExit as stop:  # argparse's way to refuse arguments
            status = stop.code
    if status:
        lines = " / ".join(stderr.getvalue().strip().splitlines()[-QUOTED_LINES:])
        raise BadInputError(f"{name} ended with status {status}: {lines}")
