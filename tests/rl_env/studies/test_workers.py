"""Command lines in worker processes: their failures are told, their output is not mixed in."""

import argparse
import os
import sys

import pytest

from pendulum_rl_env.studies.workers import ONE_CORE, limit_workers_to_one_core, run_in_worker
from pendulum_twin.errors import BadInputError


def greet(arguments: list[str]) -> int:
    print("printed")
    print("first\nsecond", arguments[0], file=sys.stderr)
    return int(arguments[1])


def refuse(arguments: list[str]) -> int:
    argparse.ArgumentParser(prog="refuse").parse_args(arguments)
    return 0


def die(arguments: list[str]) -> int:
    os._exit(7)


def check_cores(arguments: list[str]) -> int:
    return 0 if all(os.environ.get(name) == value for name, value in ONE_CORE.items()) else 1


def test_a_command_line_that_succeeds_prints_nothing_here(capfd) -> None:
    run_in_worker("greet", greet, ["there", "0"])
    assert capfd.readouterr() == ("", "")


def test_a_failure_is_told_with_the_end_of_stderr() -> None:
    with pytest.raises(BadInputError, match=r"^greet ended with status 3: first / second there$"):
        run_in_worker("greet", greet, ["there", "3"])


def test_refused_arguments_are_a_failure_too() -> None:
    with pytest.raises(BadInputError, match=r"refuse ended with status 2: .*unrecognized"):
        run_in_worker("refuse", refuse, ["--colour", "red"])


def test_a_process_that_dies_is_told() -> None:
    with pytest.raises(BadInputError, match="die: expected its result, but its process"):
        run_in_worker("die", die, [])


def test_workers_use_one_core_while_they_are_limited_to_it() -> None:
    before = dict(os.environ)
    with limit_workers_to_one_core():
        run_in_worker("check_cores", check_cores, [])
    assert dict(os.environ) == before
