"""Measure which share of a diagnosis is done when each of its stages begins.

The means are the table `BEGINS` of `verbs/progress.py`.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np

import pendulum_sysid as ps
from pendulum_sysid.finding.stages import Stage
from pendulum_twin.command_line import add_version, run_command
from pendulum_twin.parser import Parser, complete


def measure_shares(trial: Path) -> tuple[dict[Stage, float], float]:
    """Return the share of the time that is over as each stage first begins, and the time, s."""
    began: dict[Stage, float] = {}
    start = time.monotonic()

    def note(line: str) -> None:
        if isinstance(line, Stage):
            began.setdefault(line, time.monotonic() - start)

    ps.diagnose(trial / "bag", trial / "twin.yaml", note)
    total = time.monotonic() - start
    return {stage: seconds / total for stage, seconds in began.items()}, total


def measure_trials(trials: Sequence[Path]) -> None:
    """Print a line a stage: the mean share over the trials, least and most, and how many."""
    shares, totals = [], []
    for trial in trials:
        share, seconds = measure_shares(trial)
        shares.append(share)
        totals.append(seconds)
        print(trial, *(f"{stage.name} {x:.3f}" for stage, x in share.items()), flush=True)
    for stage in Stage:
        values = [share[stage] for share in shares if stage in share]
        if values:
            low, mean, high = min(values), float(np.mean(values)), max(values)
            print(f"{stage.name:12} {mean:.2f} [{low:.2f}, {high:.2f}] of {len(values)}")
    print(f"seconds: {', '.join(f'{total:.0f}' for total in totals)}")


def main(arguments: Sequence[str] | None = None) -> int:
    """Measure the trials of the command line; return the exit status."""
    run = "python -m pendulum_sysid.studies.stage_shares"
    examples = (f"{run} out/trials/trial_0000 out/trials/trial_0001",)
    parser = Parser(prog="stage_shares", description=__doc__, examples=examples)
    add_version(parser)
    trials = "folders of `pendulum_bridge.studies.trials`"
    parser.add_argument("trials", type=Path, nargs="+", metavar="TRIAL", help=trials)
    complete(parser)
    given = parser.parse_args(arguments)
    return run_command("stage_shares", lambda: measure_trials(given.trials), "nothing written")


if __name__ == "__main__":
    sys.exit(main())
