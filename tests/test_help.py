"""The help of every program and verb: a version, --quiet, an example that parses, defaults."""

import argparse
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator

import pytest
from support.paths import SRC
from support.programs import list_executables

from pendulum_sysid.verbs.options import make_parser
from pendulum_twin.parser import Parser

STUDIES = {
    "demo": "pendulum_bridge.studies.demo",
    "trials": "pendulum_bridge.studies.trials",
    "stepped_rig": "pendulum_bridge.stepped_rig",
    "ablation": "pendulum_sysid.studies.ablation.__main__",
}
LEARNING = (
    "adaptation", "controllers", "identify_and_control", "optimum", "sample_times", "transfer",
    "tune",
)  # fmt: skip
WITHOUT_QUIET = {"stepped_rig"}  # says nothing but samples


EXECUTABLES = list_executables()


def print_help(name: str, *arguments: str) -> str:
    if name in STUDIES:
        call = f"from {STUDIES[name]} import main; sys.exit(main({list(arguments)!r}))"
    else:
        module, function = EXECUTABLES[name].split(":")
        call = f"from {module} import {function}; sys.exit({function}())"
    words = [sys.executable, "-c", f"import sys; {call}", *arguments]
    return run_python(*words)


def run_python(*words: str) -> str:
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.parametrize("name", sorted({*EXECUTABLES, *STUDIES}))
def test_every_program_says_examples_and_common_options(name: str) -> None:
    check_help(name, print_help(name, "--help"))


def test_every_study_of_learning_says_the_same() -> None:
    """All in one process: each would import torch by itself, which takes seconds."""
    program = """
import contextlib, importlib, sys
for name in sys.argv[1:]:
    print(f"<study {name}>")
    with contextlib.suppress(SystemExit):
        importlib.import_module(f"pendulum_rl_env.studies.{name}").main(["--help"])
"""
    said = run_python(sys.executable, "-c", program, *LEARNING).split("<study ")[1:]
    helps = dict(text.split(">\n", 1) for text in said)
    assert tuple(helps) == LEARNING
    for name, text in helps.items():
        check_help(name, text)
        assert "default" in text


def check_help(name: str, said: str) -> None:
    assert "\nexamples:\n  " in said, said
    assert "--version" in said and ("--quiet" in said or name in WITHOUT_QUIET)
    examples = said.split("\nexamples:\n")[1].splitlines()
    assert all(name in line for line in examples if line.strip())


def list_verbs(parser: argparse.ArgumentParser, name: str) -> Iterator[tuple[str, Parser]]:
    """Yield `sysid`, its verbs, and the verbs of these."""
    assert isinstance(parser, Parser)
    yield name, parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for verb, below in action.choices.items():
                yield from list_verbs(below, f"{name} {verb}")


VERBS = dict(list_verbs(make_parser(), "sysid"))


@pytest.mark.parametrize("name", VERBS)
def test_every_verb_shows_what_stands_where_nothing_is_given(name: str) -> None:
    said = VERBS[name].format_help()
    telling = [
        action
        for action in VERBS[name]._actions
        if action.option_strings and action.default not in (None, False, (), argparse.SUPPRESS)
    ]
    assert said.count("default") >= len(telling)
    assert "--quiet" in said and "--version" in said


@pytest.mark.parametrize("name", VERBS)
def test_examples_of_verbs_are_right_use(name: str) -> None:
    examples = (VERBS[name].epilog or "").splitlines()[1:]
    assert examples, name
    for line in examples:
        words = shlex.split(line)
        assert line.strip().startswith(name) and words[0] == "sysid"
        make_parser().parse_args(words[1:])  # ends with SystemExit when it is not


def test_every_verb_that_answers_has_json() -> None:
    answering = [name for name in VERBS if not VERBS[name]._subparsers]
    assert len(answering) > 14
    assert [name for name in answering if "--json" not in VERBS[name].format_help()] == []


def test_a_number_that_stands_for_a_default_is_not_written_twice() -> None:
    for name, verb in VERBS.items():
        assert not re.search(r"default[^)]*\).{0,3}\(default", verb.format_help()), name


def test_no_program_makes_a_parser_of_its_own() -> None:
    texts = {path: path.read_text() for path in SRC.glob("*/pendulum_*/**/*.py")}
    assert len(texts) > 300
    assert [path for path, text in texts.items() if "argparse.ArgumentParser(" in text] == []
