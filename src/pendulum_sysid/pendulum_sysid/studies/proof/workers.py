"""Processes that examine trials side by side, one thread each."""

from __future__ import annotations

import multiprocessing
import os
import signal
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path

from pendulum_sysid.studies.proof.examine_trial import examine_trial, is_complete
from pendulum_sysid.studies.proof.warm_up import compile_kernels
from pendulum_twin.errors import BadInputError

# Two threads on a busy machine can be hundreds of times slower than one: a process takes one.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)


def examine_trials(
    folders: Iterable[Path], rivals: Sequence[str], processes: int, done: Callable[[Path], None]
) -> list[Path]:
    """Examine trials as their folders come, in so many processes, and return them in order of their names.

    done: called with each once it is examined. Raises BadInputError when a process dies.
    """
    with _pool(processes) as pool:
        waiting: set[Future[Path]] = set()
        finished: list[Path] = []
        try:
            for folder in folders:
                if is_complete(folder, rivals):
                    done(folder)
                    finished.append(folder)
                    continue
                waiting.add(pool.submit(examine_trial, folder, rivals))
                ready = {one for one in waiting if one.done()}
                finished += [_told(one, done) for one in ready]
                waiting -= ready
            finished += [_told(one, done) for one in as_completed(waiting)]
        except BrokenProcessPool as error:
            raise BadInputError(
                "expected every trial to be examined, found a process dead, for lack of memory perhaps: run again to go on "
                "from here, with fewer --processes"
            ) from error
    return sorted(finished)


def _told(one: Future[Path], done: Callable[[Path], None]) -> Path:
    folder = one.result()
    done(folder)
    return folder


@contextmanager
def _pool(processes: int) -> Iterator[ProcessPoolExecutor]:
    """Give a pool whose processes end at once, half done or not, when the work is broken off."""
    before = set(multiprocessing.active_children())
    with _environment(ONE_THREAD):
        pool = ProcessPoolExecutor(
            processes, multiprocessing.get_context("spawn"), initializer=_begin
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
def _environment(values: Mapping[str, str]) -> Iterator[None]:
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


def _begin() -> None:
    """Leave interrupts to the process that waits, say nothing of runs that overflow (their score does), and get warm."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    compile_kernels()
