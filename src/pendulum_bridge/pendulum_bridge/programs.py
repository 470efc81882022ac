"""Programs that run side by side for a while: each with a log of its own, ended together, in order, whatever happens."""

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

from pendulum_twin.errors import BadInputError

STEP_S = 0.05  # from one look at a log to the next
ENDING_S = 10.0  # given to a program to end by itself after SIGINT
SCRIPTS = Path(sys.executable).parent


@dataclass(frozen=True)
class Program:
    """Hold a running program; log: file with all it has said, None when it speaks to the terminal."""

    name: str
    process: subprocess.Popen[bytes]
    log: Path | None

    @property
    def said(self) -> str:
        """Return all that it has said so far."""
        return "" if self.log is None else self.log.read_text(encoding="utf-8", errors="replace")


class Programs:
    """Start programs and end them all on leaving the `with`, the last one first.

    logs: folder for what they say. environment: what is set for them beyond this process's own.
    """

    def __init__(self, logs: Path, environment: Mapping[str, str]) -> None:
        self._logs, self._environment = logs, {**os.environ, **environment}
        self._programs: list[Program] = []
        logs.mkdir(parents=True, exist_ok=True)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for program in reversed(self._programs):
            end(program)

    def start(self, name: str, *arguments: object, heard: bool = False) -> Program:
        """Start an executable of this workspace; heard: what it says goes to the terminal instead of its log.

        Raises BadInputError when it cannot be run.
        """
        log = None if heard else self._logs / f"{name}.log"
        command = [str(SCRIPTS / name), *map(str, arguments)]
        out = None if log is None else log.open("wb")
        try:  # a group of its own: Ctrl-C reaches this process alone, which ends the others in order
            process = subprocess.Popen(
                command,
                stdout=out,
                stderr=out,
                env=self._environment,
                process_group=0,
                stdin=subprocess.DEVNULL,
            )
        except OSError as error:
            raise BadInputError(
                f"expected the program {command[0]}, but it cannot be run: {error.strerror}"
            ) from error
        finally:
            if out is not None:
                out.close()
        self._programs.append(Program(name, process, log))
        return self._programs[-1]

    def check(self) -> None:
        """Raise BadInputError with its last words when a program has ended with another status than 0."""
        for program in self._programs:
            if program.process.poll():
                raise _failed(program)


def wait_for(program: Program, words: str, seconds: float) -> None:
    """Return when a program has said the words; raise BadInputError when it ends before, or takes too long."""
    deadline = time.monotonic() + seconds
    while words not in program.said:
        if _ended_within(program, STEP_S):
            raise _failed(program)
        if time.monotonic() > deadline:
            raise BadInputError(
                f"{program.name}: expected it to say {words!r} within {seconds:g} s: see {program.log}"
            )


def wait_until_done(program: Program, others: Programs, seconds: float) -> None:
    """Return when a program has ended with status 0; raise BadInputError when it or another fails, or takes too long."""
    deadline = time.monotonic() + seconds
    while not _ended_within(program, 4 * STEP_S):
        others.check()
        if time.monotonic() > deadline:
            raise BadInputError(f"{program.name}: expected it to be done within {seconds:g} s")
    others.check()


def end(program: Program) -> None:
    """End a program: SIGINT, and SIGKILL when it takes too long."""
    if program.process.poll() is None:
        program.process.send_signal(signal.SIGINT)
        if not _ended_within(program, ENDING_S):
            program.process.kill()
            program.process.wait()


def _ended_within(program: Program, seconds: float) -> bool:
    try:
        program.process.wait(seconds)
    except subprocess.TimeoutExpired:
        return False
    return True


def _failed(program: Program) -> BadInputError:
    lines = [line for line in program.said.splitlines() if line.strip()]
    last = f": {lines[-1]}" if lines else ""
    return BadInputError(f"{program.name} ended with status {program.process.returncode}{last}")
