"""Processes that record and examine trials side by side, one thread each."""

from __future__ import annotations

import multiprocessing
import os
import signal
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path

from pendulum_sysid.studies.errors import WorkerError
from pendulum_sysid.studies.proof.examine_trial import examine_trial, is_complete
from pendulum_sysid.studies.proof.record_trial import locate_trial, record_trial
from pendulum_sysid.studies.proof.warm_up import compile_kernels

# Two threads on a busy machine can be hundreds of times slower than one: a process takes one.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


def examine_trials(
    folder: Path,
    count: int,
    options: Sequence[str],
    rivals: Sequence[str],
    processes: int,
    report: Callable[[Path], None],
) -> list[Path]:
    """Record and examine the first trials of a folder, and return their folders in order.

    What was recorded or examined before is not done again.

    count: how many trials.
    options: of the recorder's command line.
    rivals: names of the rivals to ask as well.
    processes: how many trials are worked on side by side.
    report: called with the folder of each trial once it is examined.
    Raises BadInputError when a trial cannot be recorded, WorkerError when a process dies.
    """
    trials = [locate_trial(folder, number) for number in range(count)]
    complete = [is_complete(trial, rivals) for trial in trials]
    for trial, done in zip(trials, complete, strict=True):
        if done:
            report(trial)
    with open_pool(processes) as pool:
        futures = [
            pool.submit(_record_and_examine, folder, number, options, rivals)
            for number, done in enumerate(complete)
            if not done
        ]
        try:
            for future in as_completed(futures):
                report(future.result())
        except BrokenProcessPool as error:
            raise WorkerError(
                "a process that examined trials ended before its work was done, for lack of "
                "memory perhaps: run the same command again to go on from here, with fewer "
                "--processes"
            ) from error
    return trials


def _record_and_examine(
    folder: Path, number: int, options: Sequence[str], rivals: Sequence[str]
) -> Path:
    return examine_trial(record_trial(folder, number, options), rivals)


@contextmanager
def open_pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Open a pool whose processes end at once when the work is broken off."""
    before = set(multiprocessing.active_children())
    with _set_environment(ONE_THREAD):
        pool = ProcessPoolExecutor(
            processes, multiprocessing.get_context("spawn"), initializer=_start_worker
        )
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            for child in set(multiprocessing.active_children()) - before:
                child.terminate()
            raise
        pool.shutdown()


@contextmanager
def _set_environment(values: Mapping[str, str]) -> Iterator[None]:
    before = {name: os.environ.get(name) for name in values}
    os.environ.update(values)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _start_worker() -> None:
    """Prepare a process: interrupts are the parent's, overflowing runs show in their score."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    compile_kernels()
