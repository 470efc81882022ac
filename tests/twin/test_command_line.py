"""Options are checked and refused in a sentence; a command that cannot be done ends in one."""

import argparse

import pytest

from pendulum_twin.command_line import (
    as_option,
    make_number_reader,
    make_whole_reader,
    run_command,
)
from pendulum_twin.errors import BadInputError


@pytest.mark.parametrize("text", ["-1", "1.0", "", "²", "٣", "1e3", "4", "1" * 5000])
def test_only_a_whole_number_within_its_bounds_is_taken(text):
    with pytest.raises(
        argparse.ArgumentTypeError, match=f"expected a whole number from 0 to 3, found {text!r}"
    ):
        make_whole_reader(0, 3)(text)


@pytest.mark.parametrize("text", ["nan", "inf", "0.9", "x", ""])
def test_only_a_number_within_its_bounds_is_taken(text):
    with pytest.raises(
        argparse.ArgumentTypeError, match=f"expected a number from 1 to 10, found {text!r}"
    ):
        make_number_reader(1, 10)(text)


def test_bounds_belong_to_the_range():
    assert (
        make_whole_reader(0, 3)("0"),
        make_whole_reader(0, 3)("3"),
        make_whole_reader(1)("10000000000"),
    ) == (0, 3, 10**10)
    assert (make_number_reader(1, 10)("1"), make_number_reader(1, 10)("1e1")) == (1.0, 10.0)


def test_a_readers_own_sentence_reaches_the_user():
    def refuse(text: str) -> None:
        raise BadInputError(f"not {text}")

    with pytest.raises(argparse.ArgumentTypeError, match="not this"):
        as_option(refuse)("this")


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (BadInputError("expected a twin"), 1, "tool: expected a twin\n"),
        (KeyboardInterrupt(), 130, "tool: interrupted; nothing is lost\n"),
        (
            PermissionError(13, "Permission denied", "a.yaml"),
            1,
            "tool: [Errno 13] Permission denied: 'a.yaml'\n",
        ),
    ],
)
def test_what_cannot_be_done_ends_in_one_line(error, status, said, capsys):
    def work() -> None:
        raise error

    assert run_command("tool", work, "nothing is lost") == status
    assert capsys.readouterr() == ("", said)


def test_an_errors_own_status_is_the_exit_status(capsys):
    class WrongOption(BadInputError):
        exit_status = 2

    def work() -> None:
        raise WrongOption("expected another option")

    assert run_command("tool", work, "") == 2
    assert capsys.readouterr().err == "tool: expected another option\n"


def test_the_works_own_status_is_the_exit_status(capsys):
    assert (run_command("tool", lambda: None, ""), run_command("tool", lambda: 1, "")) == (0, 1)
    assert capsys.readouterr() == ("", "")
