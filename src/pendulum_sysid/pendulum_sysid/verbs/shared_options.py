"""Options that several verbs of `sysid` share."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pendulum_sysid.verbs.examples import EXAMPLES
from pendulum_twin.parser import Parser, add_common_options, offer
from pendulum_twin.rig import UNITS

if TYPE_CHECKING:
    Verbs = argparse._SubParsersAction[Parser]


def add_verb(verbs: Verbs, name: str, sentence: str, of: str = "") -> Parser:
    """Add a verb with its examples and the options that every verb has.

    verbs: of `sysid`, or of the verb `of`.
    sentence: what the verb does.
    """
    verb = verbs.add_parser(
        name,
        help=sentence,
        description=sentence[0].upper() + sentence[1:] + ".",
        examples=EXAMPLES[f"{of} {name}".strip()],
    )
    add_common_options(verb, argparse.SUPPRESS)
    verb.add_argument(
        "--effects",
        metavar="FOLDER",
        default=argparse.SUPPRESS,
        help="effects of your own, beside the catalogue",
    )
    verb.add_argument(
        "--traceback", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )
    verb.set_defaults(parser=verb)
    return verb


def add_json(verb: argparse.ArgumentParser) -> None:
    """Add --json: stdout then holds a single JSON object, and nothing else."""
    verb.add_argument("--json", action="store_true", help="print one JSON object")


def add_bags(verb: argparse.ArgumentParser) -> None:
    """Add recordings and their topics."""
    verb.add_argument(
        "bag",
        nargs="+",
        type=Path,
        metavar="BAG",
        help="a rosbag2 folder or its data file; several of one rig count together",
    )
    add_topics(verb)


def add_topics(verb: argparse.ArgumentParser) -> None:
    """Add the topics of a recording."""
    verb.add_argument(
        "--state-topic", metavar="T", help="topic of the states (default: /rig/joint_states)"
    )
    verb.add_argument(
        "--command-topic", metavar="T", help="topic of the commands (default: /rig/pwm)"
    )


def add_twin(verb: argparse.ArgumentParser, what: str) -> None:
    """Add --twin, the twin file of a verb that takes a single one."""
    verb.add_argument("--twin", required=True, type=Path, action=_KeepOnly, help=what)


class _KeepOnly(argparse.Action):
    """Keep the value of an option that is given once, and refuse a second one."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: Any,
        option_string: str | None = None,
    ) -> None:
        """Keep the value; end with status 2 where there is one already."""
        if getattr(namespace, self.dest) is not None:
            parser.error(
                f"expected {option_string} once, found it again with {values}: give a single twin "
                "file (sysid compare takes two)"
            )
        setattr(namespace, self.dest, values)


def add_hold(verb: argparse.ArgumentParser) -> None:
    """Add constants that no fit changes."""
    hold = verb.add_argument(
        "--hold",
        type=_split_names,
        default=(),
        metavar="NAME[,NAME]",
        help='constants of the rig that are known and stay as they are; "all" for all of them',
    )
    offer(hold, ("all", *UNITS))


def _split_names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def read_above_zero(text: str) -> float:
    """Return a number above 0."""
    number = _read_number(text)
    if not 0.0 < number < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number above 0, found {text!r}")
    return number


def read_seconds(text: str) -> float:
    """Return a number of seconds from 0 on."""
    seconds = _read_number(text)
    if not 0.0 <= seconds < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number of seconds from 0 on, found {text!r}")
    return seconds


def _read_number(text: str) -> float:
    """Return the number, or NaN where the text is none."""
    try:
        return float(text)
    except ValueError:
        return math.nan
