"""Trials as they come: the program that conceals and records them runs beside, and names each folder when it is complete."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from pendulum_twin.errors import BadInputError

MAKER = "pendulum_bridge.trials"
MISSING = (
    "expected the package pendulum_bridge, which conceals physics in emulated rigs and records them, found it missing: "
    "install it beside pendulum_sysid"
)


def check() -> None:
    """Raise BadInputError when nothing can make trials here."""
    if importlib.util.find_spec(MAKER.split(".")[0]) is None:
        raise BadInputError(MISSING)


def trial_folders(out: Path, count: int, arguments: Sequence[str]) -> Iterator[Path]:
    """Yield the folders of the first so many trials in out: those that are there at once, the others as they are made.

    arguments: further options of the program that makes them. Raises BadInputError, in that
    program's own words, when it cannot make one; it is stopped when the caller goes away.
    """
    there = [number for number in range(count) if folder_of(out, number).is_dir()]
    yield from (folder_of(out, number) for number in there)
    for first, last in stretches(sorted(set(range(count)) - set(there))):
        wanted = ["--out", str(out), "--first", str(first), "--trials", str(last - first + 1)]
        yield from _made([sys.executable, "-m", MAKER, *wanted, *arguments])


def folder_of(out: Path, number: int) -> Path:
    """Return the folder of a trial, as the program that makes them names it."""
    return out / f"trial_{number:04d}"


def stretches(numbers: Iterable[int]) -> list[tuple[int, int]]:
    """Return rising numbers as stretches without a hole, (first, last)."""
    found: list[tuple[int, int]] = []
    for number in numbers:
        if found and found[-1][1] == number - 1:
            found[-1] = (found[-1][0], number)
        else:
            found.append((number, number))
    return found


def _made(command: list[str]) -> Iterator[Path]:
    with (
        tempfile.TemporaryFile("w+") as complaints,
        subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=complaints, text=True
        ) as maker,
    ):
        assert maker.stdout is not None
        try:
            yield from (Path(line.rstrip("\n")) for line in maker.stdout)
            status = maker.wait()
        finally:
            if maker.poll() is None:
                maker.terminate()
        if status:
            complaints.seek(0)
            said = complaints.read().strip().splitlines() or [f"it ended with status {status}"]
            raise BadInputError(f"the program that records trials could not go on: {said[-1]}")
