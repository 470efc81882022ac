"""Read the options of the programs in docs/: those that several of them take."""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from pathlib import Path

from pendulum_twin.command_line import add_version, as_option
from pendulum_twin.errors import BadInputError
from pendulum_twin.parser import Parser


@as_option
def read_folder(text: str) -> Path:
    """Return the path of a folder that has to be there."""
    folder = Path(text)
    if not folder.is_dir():
        there = "a file" if folder.exists() else "nothing there"
        raise BadInputError(f"expected a folder, found {there}: {text}")
    return folder


def make_parser(program: str, description: str | None, *examples: str) -> Parser:
    """Return a program's parser, with --help and --version.

    program: name of its file, without the ending.
    examples: the words after the program's name.
    """
    lines = [f"python docs/{program}.py {words}".rstrip() for words in examples]
    parser = Parser(prog=program, description=description, examples=lines)
    add_version(parser)
    return parser


def parse_study_of_rigs(
    program: str, description: str | None, names: Iterable[str], arguments: Sequence[str] | None
) -> argparse.Namespace:
    """Return `rigs`, `out` and `names` of a study of real rigs; no name means every name."""
    parser = make_parser(program, description, "recordings out/rigs", "recordings out/rigs emps")
    add = parser.add_argument
    add("rigs", type=read_folder, metavar="RIGS", help="folder that holds the recordings")
    add("out", type=Path, metavar="OUT", help="folder for what is made of them")
    add("names", nargs="*", metavar="RIG", choices=list(names), help="by default all: %(choices)s")
    given = parser.parse_args(arguments)
    given.names = given.names or list(names)
    return given
