"""Studies on the engine, and command lines within them: failures are told, output apart."""

import argparse
import os
import sys

import pytest

from pendulum_rl_env.studies.workers import run_program, run_study
from pendulum_sysid.fleet.engine import ONE_THREAD
from pendulum_twin.errors import BadInputError

OPTIONS = argparse.Namespace(workers=1, scheduler=None)


def greet(arguments: list[str]) -> int:
    print("printed")
    print("first\nsecond", arguments[0], file=sys.stderr)
    return int(arguments[1])


def refuse(arguments: list[str]) -> int:
    argparse.ArgumentParser(prog="refuse").parse_args(arguments)
    return 0


def act(item: str) -> str:
    if item == "die":
        os._exit(7)
    if item == "greet":
        run_program("greet", greet, ["there", "3"])
    return item + str([os.environ.get(name) for name in ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS")])


def test_a_command_line_that_succeeds_prints_nothing_here(capfd) -> None:
    run_program("greet", greet, ["there", "0"])
    assert capfd.readouterr() == ("", "")


def test_a_failure_is_told_with_the_end_of_stderr() -> None:
    with pytest.raises(BadInputError, match=r"^greet ended with status 3: first / second there$"):
        run_program("greet", greet, ["there", "3"])


def test_refused_arguments_are_a_failure_too() -> None:
    with pytest.raises(BadInputError, match=r"refuse ended with status 2: .*unrecognized"):
        run_program("refuse", refuse, ["--colour", "red"])


def test_results_come_in_order_from_workers_of_one_thread() -> None:
    assert set(ONE_THREAD.values()) == {"1"}
    assert run_study(act, ["b", "a"], OPTIONS) == ["b['1', '1']", "a['1', '1']"]


def test_the_rest_is_done_before_a_failure_is_told() -> None:
    ended: list[str] = []
    with pytest.raises(BadInputError, match=r"greet ended with status 3|died twice"):
        run_study(act, ["greet", "die", "c"], OPTIONS, lambda item, result: ended.append(item))
    assert ended == ["c"]
