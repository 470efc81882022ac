"""A Dask cluster of this machine's processes that outlives any of its workers."""

from __future__ import annotations

import logging
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker

from distributed import LocalCluster as DaskCluster

from pendulum_twin.errors import BadInputError


class LocalCluster(DaskCluster):  # type: ignore[misc]
    """Run workers as processes of this machine.

    Dask's own cluster stops watching its workers, and ends with a KeyError, where it hears that a
    worker has gone of which it has not heard before: the worker was ended while it started.
    """

    def _update_worker_status(self, op: str, msg: object) -> None:
        if op != "remove" or msg in self.scheduler_info["workers"]:
            super()._update_worker_status(op, msg)


def start_cluster(workers: int, memory_bytes: int) -> LocalCluster:
    """Start a cluster of so many processes of one thread each.

    memory_bytes: limit of a worker, beyond which it is ended.
    Ctrl-C counts once the workers have started. Raises BadInputError where a worker ends while it
    starts.
    """
    try:
        with _hold_back_interrupts():
            return LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=memory_bytes,
                dashboard_address="127.0.0.1:0",
                host="127.0.0.1",
                silence_logs=logging.CRITICAL,
            )
    except (RuntimeError, OSError, TimeoutError) as error:
        raise BadInputError(
            f"expected {workers} worker processes, found that one ended while it started "
            f"({error}): run the same command again, with fewer workers if memory is short"
        ) from error


@contextmanager
def _hold_back_interrupts() -> Iterator[None]:
    """Hold Ctrl-C back; threads and processes that start meanwhile never get it.

    A terminal sends Ctrl-C to the workers, too, which print tracebacks while they start, and Dask
    cannot close a cluster that has not started. This program ends its workers itself.
    """
    resource_tracker.ensure_running()  # its start would let the signal through again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
