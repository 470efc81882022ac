"""The engine: tasks that end, complain, or end their worker; a worker or scheduler that goes."""

import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import dask
import distributed.deploy.spec as dask_spec
import pytest
from support.engine_tasks import act_as_told, get_process
from support.polling import until

from pendulum_sysid.fleet import engine as engine_module
from pendulum_sysid.fleet.engine import Engine, SchedulerLost, open_client, run_tasks
from pendulum_twin.errors import BadInputError


@pytest.fixture(scope="module")
def client() -> Iterator[object]:
    with open_client(Engine(workers=2)) as opened:
        yield opened


def test_ctrl_c_is_for_the_program_and_not_for_its_workers(client) -> None:
    """A terminal sends it to all of them: a worker that starts would print a traceback."""
    blocked = client.run(signal.pthread_sigmask, signal.SIG_BLOCK, [])
    assert len(blocked) == 2 and all(signal.SIGINT in signals for signals in blocked.values())
    assert signal.SIGINT not in signal.pthread_sigmask(signal.SIG_BLOCK, [])


def test_every_ending_is_told_and_the_rest_goes_on(client) -> None:
    items = [1, "die", "complain", 2, "hang", 3]
    endings = {e.item: e for e in run_tasks(client, act_as_told, items, time_limit_s=1.0)}
    assert set(endings) == set(items)
    assert [endings[k].result for k in (1, 2, 3)] == [1, 4, 9]
    assert "died twice" in endings["die"].put_aside
    assert "longer than 1 s, twice" in endings["hang"].put_aside
    assert isinstance(endings["complain"].error, BadInputError)


def test_a_killed_worker_loses_nothing_and_repeats_nothing(client, tmp_path: Path) -> None:
    """A process that is ended from outside once: its task is done again, by another."""
    item = tmp_path / "task"
    killer = threading.Thread(target=kill_first_worker, args=(item,))
    killer.start()
    endings = list(run_tasks(client, act_as_told, [item, 5, 6]))
    killer.join()
    assert sorted(str(e.result) for e in endings) == sorted([str(item), "25", "36"])


def test_a_result_that_dies_with_its_worker_is_computed_again(client) -> None:
    """The task has ended, but nobody has fetched its result when the worker is killed."""
    endings = run_tasks(client, get_process, range(3))
    process = next(endings).result
    until(lambda: all_have_ended(client), "the tasks' end")
    for pid in set(client.run(os.getpid).values()):
        os.kill(pid, signal.SIGKILL)
    assert process and len(list(endings)) == 2


def test_a_worker_that_is_killed_again_and_again_comes_back() -> None:
    """Dask gives up a worker that is away a while after an earlier end; the engine does not."""
    impatient = dask.config.set({"distributed.deploy.lost-worker-timeout": "1ms"})
    with impatient, open_client(Engine(workers=1)) as client:
        process = 0
        for _ in range(3):
            process = until(lambda last=process: get_other_process(client, last), "a worker")
            os.kill(process, signal.SIGKILL)
        assert [e.result for e in run_tasks(client, act_as_told, [3])] == [9]


def test_a_worker_that_is_ended_while_it_starts_ends_no_cluster() -> None:
    """Dask's cluster hears of its end alone: KeyError, and it watches no worker any more."""
    assert "_update_worker_status" in vars(dask_spec.SpecCluster)  # private: ours replaces it
    with open_client(Engine(workers=1)) as client:
        client.cluster._update_worker_status("remove", "tcp://127.0.0.1:9")
        assert [e.result for e in run_tasks(client, act_as_told, [3])] == [9]


def get_other_process(client, last: int) -> int:
    """Return the process of a worker, another than the last; 0 where there is none."""
    answers = client.run(os.getpid, on_error="return").values()
    return next((p for p in answers if isinstance(p, int) and p != last), 0)


def all_have_ended(client) -> bool:
    return not any(client.processing().values())


def kill_first_worker(item: Path) -> None:
    process = until(lambda: item.is_file() and item.read_text(), "the task's process")
    os.kill(int(process), signal.SIGKILL)
    item.with_suffix(".go").touch()  # for the worker that does the task again


def test_a_scheduler_that_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(engine_module, "CONNECT_S", 1.0)
    with (
        pytest.raises(BadInputError, match=r"expected a Dask scheduler at tcp://127\.0\.0\.1:9"),
        open_client(Engine(scheduler="tcp://127.0.0.1:9")),
    ):
        raise AssertionError


@contextmanager
def open_cluster(folder: Path) -> Iterator[tuple[subprocess.Popen, subprocess.Popen, str]]:
    """Give a scheduler, a worker, each a process of its own, and the scheduler's address."""
    file, path = folder / "scheduler.json", os.pathsep.join(sys.path)
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    dask_program = [sys.executable, "-m", "dask"]
    scheduler = subprocess.Popen(
        [*dask_program, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard",
         "--scheduler-file", str(file)], **quiet, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    worker = subprocess.Popen(
        [*dask_program, "worker", "--scheduler-file", str(file), "--nthreads", "1",
         "--no-dashboard", "--no-nanny"], **quiet, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    try:
        yield scheduler, worker, until(lambda: read_address(file), "the scheduler's address")
    finally:
        for process in (worker, scheduler):
            process.kill()
            process.wait()


def test_another_cluster_over_tcp_and_its_end(tmp_path: Path) -> None:
    """The scheduler is killed under way."""
    with (
        open_cluster(tmp_path) as (scheduler, _, address),
        open_client(Engine(scheduler=address)) as client,
    ):
        assert sorted(e.result for e in run_tasks(client, act_as_told, [1, 2, 3])) == [1, 4, 9]
        endings = run_tasks(client, act_as_told, [2, "hang"])
        assert next(endings).result == 4
        scheduler.kill()
        with pytest.raises(SchedulerLost, match="run the same command again"):
            next(endings)


def test_another_cluster_whose_workers_all_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with (
        open_cluster(tmp_path) as (_, worker, address),
        open_client(Engine(scheduler=address)) as client,
    ):
        endings = run_tasks(client, act_as_told, [2, "hang"])
        assert next(endings).result == 4
        monkeypatch.setattr(engine_module, "WORKERS_S", 1.0)
        worker.kill()
        with pytest.raises(BadInputError, match="expected workers that go on, found none for 1 s"):
            next(endings)


def read_address(file: Path) -> str:
    """Return the address of a scheduler; empty before its file is whole."""
    try:
        return json.loads(file.read_text())["address"]
    except (FileNotFoundError, ValueError):
        return ""
