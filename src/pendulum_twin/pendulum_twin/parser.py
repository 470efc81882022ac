"""Parse the command line of every program alike: help with defaults and examples, and hints.

A program makes a `Parser`, adds its options, calls `complete` and parses. The help ends in
examples, and every option whose default says something shows it. What is refused suggests the name
that was meant.
"""

from __future__ import annotations

import argparse
import os
import re
import sys
import textwrap
from collections.abc import Iterable, Sequence
from itertools import takewhile
from typing import Any, NoReturn

from pendulum_twin.command_line import add_version
from pendulum_twin.suggest import add_hint, suggest_names

COMPLETING = "_ARGCOMPLETE"  # variable that the shell's completion sets
CHOICES = re.compile(r"invalid choice: '(.*?)' \(choose from (.*)\)")
UNRECOGNISED = re.compile(r"unrecognized arguments: (\S+)")
TELLING_NOTHING: tuple[object, ...] = (argparse.SUPPRESS, "", (), [])  # as a default in the help


class HelpFormatter(argparse.HelpFormatter):
    """Fill paragraphs, keep indented lines as they are, and show the defaults of options."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        lines: list[str] = []
        for block in re.findall(r"(?:^[ \t].*\n?|^\n)+|(?:^\S.*\n?)+", text, re.MULTILINE):
            if block[0].isspace():
                lines.append(block.rstrip("\n") if block.strip() else "")
            else:
                lines.append(textwrap.fill(" ".join(block.split()), width))
        return "\n".join(lines)

    def _get_help_string(self, action: argparse.Action) -> str | None:
        text = action.help
        if text is None or not action.option_strings or "default" in text:
            return text
        default = action.default
        if default is None or default is False or default in TELLING_NOTHING:
            return text
        return f"{text} (default: %(default)s)"


class Parser(argparse.ArgumentParser):
    """A parser whose help shows defaults and examples and whose refusals suggest names.

    examples: command lines for the end of the help.
    description: paragraphs; indented lines stay as they are.
    """

    def __init__(self, *args: Any, examples: Sequence[str] = (), **settings: Any) -> None:
        settings.setdefault("formatter_class", HelpFormatter)
        if examples:
            settings["epilog"] = "\n".join(["examples:", *(f"  {line}" for line in examples)])
        super().__init__(*args, **settings)
        self._has_verbs = False

    def add_subparsers(self, **settings: Any) -> Any:
        """Add verbs, each with a parser of this class."""
        self._has_verbs = True
        return super().add_subparsers(**settings)

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """Parse; refuse an unknown option before argparse misses what it was misspelt for."""
        words = sys.argv[1:] if args is None else args
        if self._has_verbs:  # what follows the verb is for the verb's own parser
            words = list(takewhile(lambda word: word.startswith("-"), words))
        self._refuse_unknown_options(words)
        return super().parse_known_args(args, namespace)

    def error(self, message: str) -> NoReturn:
        """Print usage and the mistake, with the name that was meant, and end with status 2."""
        hint = ""
        if refused := CHOICES.search(message):
            names = [name.strip(" '\"") for name in refused[2].split(",")]
            hint = add_hint(refused[1], names)
        elif unknown := UNRECOGNISED.search(message):
            hint = hint_at_options(unknown[1].partition("=")[0], self._option_string_actions)
        super().error(message + hint)

    def _refuse_unknown_options(self, words: Sequence[str]) -> None:
        known = list(self._option_string_actions)
        for word in words:
            name = word.partition("=")[0]
            if word == "--":
                return
            if re.fullmatch(r"--[A-Za-z][\w-]*", name) and not any(
                option.startswith(name) for option in known
            ):
                self.error(f"unrecognized arguments: {word}")


def hint_at_options(name: str, known: Iterable[str]) -> str:
    """Return the hint at the options that are most like an unknown option."""
    plain = [option.removeprefix("--") for option in known if option.startswith("--")]
    meant = [f"--{option}" for option in suggest_names(name.removeprefix("--"), plain)]
    return f"; did you mean {' or '.join(meant)}?" if meant else ""


def add_common_options(parser: argparse.ArgumentParser, default: Any = False) -> None:
    """Add --version and --quiet.

    default: of --quiet; `argparse.SUPPRESS` for a verb whose program has the option, too.
    """
    add_version(parser)
    parser.add_argument(
        "--quiet",
        action="store_true",
        default=default,
        help="say nothing but the answer, warnings and errors: no progress",
    )


def complete(parser: argparse.ArgumentParser) -> None:
    """Answer the shell's request for completions and end; return at once without a request."""
    if COMPLETING in os.environ:
        import argcomplete  # only then: no program starts later because of it

        argcomplete.autocomplete(parser)


def offer(action: argparse.Action, names: Iterable[str]) -> None:
    """Let the shell complete an option's value to names; other values are taken, too."""
    action.completer = lambda **_: list(names)  # type: ignore[attr-defined]
