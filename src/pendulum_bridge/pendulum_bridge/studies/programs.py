"""Programs that run side by side, each with a log file, and end together in reverse order."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from pendulum_twin.errors import WorkerError

POLL_S = 0.05  # from one look at a log to the next
GRACE_S = 10.0  # from SIGINT to SIGKILL, for a program that does not end
SCRIPTS = Path(sys.executable).parent


@dataclass(frozen=True)
class Program:
    """Hold a running program.

    name: of its executable.
    process: the operating system's process.
    log: file of its output; None when the output goes to the terminal.
    """

    name: str
    process: subprocess.Popen[bytes]
    log: Path | None

    @property
    def output(self) -> str:
        """Return all its output so far; nothing when the output goes to the terminal."""
        return "" if self.log is None else self.log.read_text(encoding="utf-8", errors="replace")


class Programs:
    """Start programs, and end them all on leaving the `with`, the last program first.

    logs: folder for the log files.
    environment: variables that the programs get beside those of this process.
    """

    def __init__(self, logs: Path, environment: Mapping[str, str]) -> None:
        self._logs, self._environment = logs, {**os.environ, **environment}
        self._programs: list[Program] = []
        logs.mkdir(parents=True, exist_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for program in reversed(self._programs):
            end_program(program)

    def start(self, name: str, *arguments: object, to_terminal: bool = False) -> Program:
        """Start an executable of this workspace; raise WorkerError when it cannot be run.

        to_terminal: whether its output goes to the terminal instead of its log.
        """
        log = None if to_terminal else self._logs / f"{name}.log"
        command = [str(SCRIPTS / name), *map(str, arguments)]
        output = None if log is None else log.open("wb")
        # A process group of its own: Ctrl-C reaches this process only, which ends the programs.
        try:
            process = subprocess.Popen(
                command,
                stdout=output,
                stderr=output,
                env=self._environment,
                process_group=0,
                stdin=subprocess.DEVNULL,
            )
        except OSError as error:
            raise WorkerError(
                f"expected the program {command[0]}, but it cannot be run: {error.strerror}"
            ) from error
        finally:
            if output is not None:
                output.close()
        self._programs.append(Program(name, process, log))
        return self._programs[-1]

    def check(self) -> None:
        """Raise WorkerError with the last line of a program that has failed."""
        for program in self._programs:
            if program.process.poll():
                raise _make_failure(program)


def wait_for(program: Program, text: str, seconds: float) -> None:
    """Return when the text stands in the program's output.

    Raises WorkerError when the program ends before, or when the seconds have passed.
    """
    deadline = time.monotonic() + seconds
    while text not in program.output:
        if _ends_within(program, POLL_S):
            raise _make_failure(program)
        if time.monotonic() > deadline:
            raise WorkerError(
                f"{program.name}: expected it to say {text!r} within {seconds:g} s: "
                f"see {program.log}"
            )


def wait_until_done(program: Program, others: Programs, seconds: float) -> None:
    """Return when the program has ended with status 0.

    Raises WorkerError when it or another program fails, or when the seconds have passed.
    """
    deadline = time.monotonic() + seconds
    while not _ends_within(program, 4 * POLL_S):
        others.check()
        if time.monotonic() > deadline:
            raise WorkerError(f"{program.name}: expected it to be done within {seconds:g} s")
    others.check()


def end_program(program: Program) -> None:
    """End a program with SIGINT; with SIGKILL when it does not end within GRACE_S."""
    if program.process.poll() is None:
        program.process.send_signal(signal.SIGINT)
        if not _ends_within(program, GRACE_S):
            program.process.kill()
            program.process.wait()


def _ends_within(program: Program, seconds: float) -> bool:
    try:
        program.process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def _make_failure(program: Program) -> WorkerError:
    lines = [line for line in program.output.splitlines() if line.strip()]
    last_line = f": {lines[-1]}" if lines else ""
    return WorkerError(f"{program.name} ended with status {program.process.returncode}{last_line}")
