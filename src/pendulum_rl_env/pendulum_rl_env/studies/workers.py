"""Run a package's command line in a worker process of its own.

A study imports the command lines of other packages and calls them. Each call gets a fresh process:
a training counts its time from its start, and what a program prints stays apart from the study's
own output.
"""

from __future__ import annotations

import io
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from multiprocessing import get_context

from pendulum_twin.errors import BadInputError

ONE_CORE = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}  # several workers share the machine
QUOTED_LINES = 3  # of what a program wrote on stderr, in the message of its failure

Main = Callable[[list[str]], int]


@contextmanager
def limit_workers_to_one_core() -> Iterator[None]:
    """Let the worker processes that are started meanwhile use one core each."""
    before = {name: os.environ.get(name) for name in ONE_CORE}
    os.environ.update(ONE_CORE)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def run_in_worker(name: str, main: Main, arguments: Sequence[str]) -> None:
    """Run a command line and return when it succeeded.

    name: of the program, for the message.
    main: its function, importable by its module's name.
    arguments: of the command line.

    Raises BadInputError with the end of what it wrote on stderr when it failed.
    """
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        try:
            status, stderr = pool.submit(_call, main, list(arguments)).result()
        except BrokenProcessPool as error:
            raise BadInputError(
                f"{name}: expected its result, but its process was ended from outside"
            ) from error
    if status:
        lines = " / ".join(stderr.strip().splitlines()[-QUOTED_LINES:])
        raise BadInputError(f"{name} ended with status {status}: {lines}")


def _call(main: Main, arguments: list[str]) -> tuple[int | str | None, str]:
    """Return the exit status and what was written on stderr."""
    stderr = io.StringIO()
    status: int | str | None
    with redirect_stdout(io.StringIO()), redirect_stderr(stderr):
        try:
            status = main(arguments)
        except SystemExit as stop:  # argparse's way to refuse arguments
            status = stop.code
    return status, stderr.getvalue()
