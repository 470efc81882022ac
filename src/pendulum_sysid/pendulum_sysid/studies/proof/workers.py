"""Record and examine trials side by side, on the engine of the fleet."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid.fleet.engine import Engine, SchedulerLost, open_client, run_tasks
from pendulum_sysid.fleet.warm_up import compile_kernels
from pendulum_sysid.studies.proof.examine_trial import examine_trial, is_complete
from pendulum_sysid.studies.proof.record_trial import locate_trial, record_trial
from pendulum_twin.errors import WorkerError


@dataclass(frozen=True)
class TrialWork:
    """Hold what one trial needs.

    folder: of all trials, which coordinator and workers share.
    number: which trial.
    options: of the recorder's command line.
    rivals: names of the rivals to ask as well.
    """

    folder: Path
    number: int
    options: tuple[str, ...]
    rivals: tuple[str, ...]


def examine_trials(
    folder: Path,
    count: int,
    options: Sequence[str],
    rivals: Sequence[str],
    engine: Engine,
    report: Callable[[Path], None],
) -> list[Path]:
    """Record and examine the first trials of a folder, and return their folders in order.

    What was recorded or examined before is not done again.

    count: how many trials.
    options: of the recorder's command line.
    rivals: names of the rivals to ask as well.
    engine: where the trials are worked on.
    report: called with the folder of each trial once it is examined.
    Raises BadInputError when a trial cannot be recorded, WorkerError when trials end their worker,
    after all others are done, or when the scheduler goes.
    """
    folder = folder.absolute()
    trials = [locate_trial(folder, number) for number in range(count)]
    complete = [is_complete(trial, rivals) for trial in trials]
    for trial, done in zip(trials, complete, strict=True):
        if done:
            report(trial)
    works = [
        TrialWork(folder, number, tuple(options), tuple(rivals))
        for number, done in enumerate(complete)
        if not done
    ]
    if works:
        _examine(works, engine, report)
    return trials


def _examine(works: Sequence[TrialWork], engine: Engine, report: Callable[[Path], None]) -> None:
    ended: list[str] = []
    try:
        with open_client(engine, compile_kernels) as client:
            for ending in run_tasks(client, _record_and_examine, works, engine.time_limit_s):
                if ending.error is not None:
                    raise ending.error
                if ending.put_aside:
                    ended.append(f"trial {ending.item.number}: {ending.put_aside}")
                elif ending.result is not None:
                    report(ending.result)
    except SchedulerLost as error:
        raise WorkerError(str(error)) from error
    if ended:
        raise WorkerError(
            f"a process that examined trials ended before its work was done ({ended[0]}"
            f"{f', and {len(ended) - 1} more' if len(ended) > 1 else ''}): run the same command "
            "again to go on from here, with fewer --processes"
        )


def _record_and_examine(work: TrialWork) -> Path:
    return examine_trial(record_trial(work.folder, work.number, work.options), work.rivals)
