"""Record one trial: conceal physics in an emulated rig and let it play, unless that was done."""

from __future__ import annotations

import importlib.util
import io
import re
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from pendulum_sysid.errors import WrongUse
from pendulum_twin.errors import BadInputError

PACKAGE = "pendulum_bridge"
PREFIX = r"^trials: (error: (argument )?)?"  # of the recorder's complaints


def check_recorder() -> None:
    """Raise BadInputError when the package that records trials is not installed."""
    if importlib.util.find_spec(PACKAGE) is None:
        raise BadInputError(
            f"expected the package {PACKAGE}, which conceals physics in emulated rigs and records "
            "them, found it missing: install it beside pendulum_sysid"
        )


def locate_trial(folder: Path, number: int) -> Path:
    """Return the folder of a trial, as the recorder names it."""
    return folder / f"trial_{number:04d}"


def record_trial(folder: Path, number: int, options: Sequence[str]) -> Path:
    """Return the folder of a trial, recorded whole or not at all; record nothing twice.

    folder: where all trials are.
    number: which trial; trial k of a seed is the same, however many are recorded.
    options: of the recorder's command line, `--seed` among them.
    Raises BadInputError, in the recorder's own words, when it cannot record the trial, and
    WrongUse when it refuses the options.
    """
    trial = locate_trial(folder, number)
    if trial.is_dir():
        return trial
    _ask_recorder(["--out", str(folder), "--first", str(number), "--trials", "1", *options])
    return trial


def check_options(options: Sequence[str]) -> None:
    """Raise the errors of `record_trial` for options that the recorder refuses; record nothing."""
    _ask_recorder(["--out", ".", "--trials", "0", *options])


def _ask_recorder(arguments: list[str]) -> None:
    """Run the recorder; raise, in its words, what it complains of."""
    complaints = io.StringIO()
    with redirect_stdout(io.StringIO()), redirect_stderr(complaints):
        status = _run_recorder(arguments)
    if status:
        lines = complaints.getvalue().splitlines() or [f"it ended with status {status}"]
        kind = WrongUse if status == WrongUse.exit_status else BadInputError
        raise kind(re.sub(PREFIX, "", lines[-1]))


def _run_recorder(arguments: list[str]) -> int:
    """Return the recorder's exit status; argparse ends wrong options by SystemExit."""
    from pendulum_bridge.studies.trials import main

    try:
        return main(arguments)
    except SystemExit as ending:
        return int(ending.code or 0)
