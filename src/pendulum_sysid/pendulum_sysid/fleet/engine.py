"""Run many tasks on a Dask cluster: workers of one thread, tasks that may kill their worker.

A task is a function that the workers can import, and an item; its result is small. A worker gets
a task when it has none, so that a worker that dies puts the blame on the task that it ran. A few
tasks a worker wait at the scheduler, so that no worker waits for the coordinator. Scheduling,
retries and messages are Dask's.
"""

from __future__ import annotations

import logging
import math
import os
import signal
import threading
import time
import uuid
import warnings
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from pendulum_twin.errors import BadInputError, WorkerError

try:
    import dask
    from distributed import (
        Client,
        KilledWorker,
        WorkerPlugin,
        as_completed,
        get_worker,
    )
    from distributed.comm.core import CommClosedError

    from pendulum_sysid.fleet.local_cluster import start_cluster
except ImportError as error:  # pragma: no cover
    raise BadInputError(
        "expected the packages of many recordings, found dask missing: "
        "pip install 'pendulum_sysid[fleet]'"
    ) from error

# Two threads on a busy machine can be hundreds of times slower than one: a worker takes one.
ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
WORKER_KILLS_FORGIVEN = 1  # a task whose worker dies is tried once more, then put aside
TASKS_A_THREAD = 1.0  # tasks that a worker's thread gets at a time
# Dask keeps tasks of one kind at the scheduler once there are more than this many a thread of
# them, and hands them out before.
TASKS_HANDED_OUT = 2
WAITING_A_THREAD = 4  # tasks at the scheduler: results may be written meanwhile
LOOK_S = 0.01  # s; between two looks at whether a task has ended
COUNT_EVERY_S = 1.0  # s; between two looks at how many workers there are
CONNECT_S = 15.0  # s; that a scheduler may take to answer
# So long after the end of a worker a local cluster looks for the worker, and gives it up if it is
# away, even if it has ended a second time and is starting again.
NEVER = "3650d"
WORKERS_S = 60.0  # s; that workers that ended may take to start again on a busy computer
TIME_UP_STATUS = 75  # exit status of a worker whose task ran too long
TIME_UP, TIME_UP_SENT_S = "sysid-time-up", 0.5  # topic of the event, and s to send it in
DIED = "its worker died twice: a crash, or too little memory"
QUIET = ("distributed", "distributed.nanny", "distributed.scheduler", "distributed.worker")
# What Dask watches for its dashboard takes cores from the workers: a statistical profile of every
# thread, a tick of every event loop each 20 ms. Without, a coordinator needs a third less CPU.
UNWATCHED = {
    "distributed.worker.profile.enabled": False,
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "5s",
}


class SchedulerLost(WorkerError):
    """Say that the scheduler stopped answering while tasks were under way."""


@dataclass(frozen=True)
class Engine:
    """Say where tasks run.

    workers: of a local cluster.
    scheduler: address of another cluster ("tcp://host:8786"); None for a local cluster.
    memory_bytes: limit of a local worker, beyond which it is ended.
    time_limit_s: s; a task that runs longer ends its worker.
    """

    workers: int = 2
    scheduler: str | None = None
    memory_bytes: int = 2_000_000_000
    time_limit_s: float = 900.0


@dataclass(frozen=True)
class Ending[Item, Result]:
    """Say how a task ended.

    item: of the task.
    result: of the function; None when it raised an error or was put aside.
    error: that the function raised; None for none.
    put_aside: why, when the task ended its worker twice; empty otherwise.
    """

    item: Item
    result: Result | None = None
    error: BaseException | None = None
    put_aside: str = ""


class _Readiness(WorkerPlugin):  # type: ignore[misc]
    """Prepare a worker: quiet, ready compiled, and deaf to the keyboard of the coordinator."""

    def __init__(self, prepare: Callable[[], None] | None, is_local: bool) -> None:
        self.name = f"readiness-{uuid.uuid4().hex}"
        self._prepare, self._is_local = prepare, is_local

    def setup(self, worker: Any) -> None:
        warnings.simplefilter("ignore")  # a run that overflows shows in its score
        if self._is_local:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
        if self._prepare is not None:
            self._prepare()


@contextmanager
def open_client(engine: Engine, prepare: Callable[[], None] | None = None) -> Iterator[Client]:
    """Open a local cluster or connect to another; a local cluster ends with the block.

    prepare: is called once in each worker before its first task.
    Raises BadInputError when no scheduler answers at the address.
    """
    levels = {name: logging.getLogger(name).level for name in QUIET}
    for name in QUIET:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    limits = {
        "distributed.comm.timeouts.connect": f"{CONNECT_S}s",
        "distributed.deploy.lost-worker-timeout": NEVER,
        "distributed.nanny.pre-spawn-environ": ONE_THREAD,
        "distributed.scheduler.allowed-failures": WORKER_KILLS_FORGIVEN,
        "distributed.scheduler.worker-saturation": TASKS_A_THREAD,
        **UNWATCHED,
    }
    try:
        with dask.config.set(limits), _connect(engine) as client:
            client.register_plugin(_Readiness(prepare, engine.scheduler is None))
            yield client
    finally:
        for name, level in levels.items():
            logging.getLogger(name).setLevel(level)


@contextmanager
def _connect(engine: Engine) -> Iterator[Client]:
    if engine.scheduler is None:
        cluster = start_cluster(engine.workers, engine.memory_bytes)
        with cluster, Client(cluster, timeout=CONNECT_S) as client:
            yield client
        return
    try:
        client = Client(engine.scheduler, timeout=CONNECT_S)
    except (OSError, ValueError) as error:
        raise BadInputError(
            f"expected a Dask scheduler at {engine.scheduler}, found that none answers: start it "
            "with `dask scheduler`, or leave out --scheduler"
        ) from error
    with client:
        client.run_on_scheduler(_set_limits)
        yield client


def _set_limits(dask_scheduler: Any) -> None:
    dask_scheduler.allowed_failures = WORKER_KILLS_FORGIVEN
    dask_scheduler.WORKER_SATURATION = TASKS_A_THREAD


def run_tasks[Item, Result](
    client: Client,
    function: Callable[[Item], Result],
    items: Iterable[Item],
    time_limit_s: float = Engine.time_limit_s,
) -> Iterator[Ending[Item, Result]]:
    """Yield how each task ended, in the order in which they end.

    function: importable by the workers.
    items: are taken when a worker is free, and a few ahead.
    time_limit_s: s; of one task.
    Raises SchedulerLost when the scheduler goes, BadInputError when it has no workers for a
    while.
    """
    _wait_for_workers(client)
    supply = _Supply(client, function, iter(items), time_limit_s)
    supply.fill()
    while supply.under_way:
        _wait_for_ending(client, supply)
        future = next(supply.finished)
        ending = _read_ending(client, future, supply.under_way[future], time_limit_s)
        if ending is None:
            supply.finished.add(future)
            continue
        del supply.under_way[future]
        supply.fill()
        yield ending


class _Supply[Item, Result]:
    """Keep the workers of a cluster supplied with tasks: one each, and a few at the scheduler.

    under_way: the tasks that have been submitted and have not ended, with their items.
    finished: yields those of them that end.
    """

    def __init__(
        self,
        client: Client,
        function: Callable[[Item], Result],
        waiting: Iterator[Item],
        time_limit_s: float,
    ) -> None:
        self._client, self._function = client, function
        self._waiting, self._time_limit_s = waiting, time_limit_s
        self.under_way: dict[Any, Item] = {}
        self.finished = as_completed(raise_errors=False)
        self._submitted = 0
        self._threads, self._counted_s = 1, -math.inf

    def fill(self) -> None:
        """Submit tasks until all threads have a task and enough wait, or no item is left."""
        for _, item in zip(range(self._count_free()), self._waiting, strict=False):
            self._submit(item)

    def _count_free(self) -> int:
        """Return how many tasks may be submitted; threads are counted anew once in a while."""
        if time.monotonic() - self._counted_s > COUNT_EVERY_S:
            self._threads = max(_count_threads(self._client), 1)
            self._counted_s = time.monotonic()
        is_kept = self._submitted > TASKS_HANDED_OUT * self._threads
        ahead = WAITING_A_THREAD * self._threads if is_kept else 0
        return self._threads + ahead - len(self.under_way)

    def _submit(self, item: Item) -> None:
        future = self._client.submit(
            _run_limited,
            self._function,
            item,
            self._time_limit_s,
            key=f"task-{uuid.uuid4().hex}",
            pure=False,
        )
        self._submitted += 1
        self.under_way[future] = item
        self.finished.add(future)


def _count_threads(client: Client) -> int:
    try:
        return sum(client.nthreads().values())
    except (OSError, ValueError, RuntimeError) as error:
        raise _name_loss(client) from error


def _wait_for_workers(client: Client) -> None:
    try:
        client.wait_for_workers(1, timeout=WORKERS_S)
    except TimeoutError as error:
        raise BadInputError(
            "expected a scheduler with workers, found it without any: start them with "
            "`dask worker ADDRESS --nthreads 1`"
        ) from error


def _wait_for_ending(client: Client, supply: _Supply[Any, Any]) -> None:
    """Return when a task has ended; raise BadInputError where no worker is there for a while."""
    present_s = looked_s = time.monotonic()
    while not supply.finished.has_ready():
        time.sleep(LOOK_S)
        if time.monotonic() - looked_s > COUNT_EVERY_S:
            looked_s = time.monotonic()
            if _count_threads(client):
                present_s = looked_s
            elif looked_s - present_s > WORKERS_S:
                raise BadInputError(
                    f"expected workers that go on, found none for {WORKERS_S:g} s: run the same "
                    "command again to go on from what is done; with --scheduler, start workers "
                    "first"
                )


def _read_ending(
    client: Client, future: Any, item: Any, time_limit_s: float
) -> Ending[Any, Any] | None:
    """Return how a task ended; None where its worker died with the result: it is done again."""
    if future.status == "finished":
        try:
            return Ending(item, future.result(timeout=CONNECT_S))
        except (CommClosedError, TimeoutError):
            pass  # the worker is gone, or the scheduler
        except Exception as error:
            if future.status != "error":
                return Ending(item, error=error)
    if future.status in ("finished", "pending", "lost"):
        _count_threads(client)  # raises an error where the scheduler is gone
        return None
    if future.status != "error":
        raise _name_loss(client)
    raised = future.exception()
    if not isinstance(raised, KilledWorker):
        return Ending(item, error=raised)
    if any(key == future.key for _, key in client.get_events(TIME_UP)):
        return Ending(item, put_aside=f"it took longer than {time_limit_s:g} s, twice")
    return Ending(item, put_aside=DIED)


def _name_loss(client: Client) -> SchedulerLost:
    return SchedulerLost(
        f"the scheduler at {client.scheduler.address if client.scheduler else '?'} stopped "
        "answering: run the same command again to go on from what is done"
    )


def _run_limited[Item, Result](
    function: Callable[[Item], Result], item: Item, limit_s: float
) -> Result:
    """Run the function; end the process when it takes too long, for nothing else stops it."""
    worker, key = get_worker(), get_worker().get_current_task()
    timer = threading.Timer(limit_s, _end_worker, (worker, str(key)))
    timer.daemon = True
    timer.start()
    try:
        return function(item)
    finally:
        timer.cancel()


def _end_worker(worker: Any, key: str) -> None:
    worker.log_event(TIME_UP, key)  # is sent in the background
    time.sleep(TIME_UP_SENT_S)
    os._exit(TIME_UP_STATUS)
