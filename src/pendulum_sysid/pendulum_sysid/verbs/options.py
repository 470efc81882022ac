"""The verbs of `sysid` and their options."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_sysid.verbs.examples import EXAMPLES
from pendulum_sysid.verbs.fleet_options import add_fleet
from pendulum_sysid.verbs.import_options import add_import
from pendulum_sysid.verbs.prove_options import add_prove
from pendulum_sysid.verbs.shared_options import (
    add_bags,
    add_hold,
    add_json,
    add_twin,
    add_verb,
    read_above_zero,
    read_seconds,
)
from pendulum_twin.command_line import make_whole_reader
from pendulum_twin.parser import Parser, add_common_options

if TYPE_CHECKING:
    from pendulum_sysid.verbs.shared_options import Verbs


def make_parser() -> argparse.ArgumentParser:
    """Make the parser: its namespace holds `verb`, the verb's own `parser`, and its options."""
    command = Parser(
        prog="sysid",
        description="Find where a digital twin of a cart-pendulum is wrong, and put it right.",
        examples=EXAMPLES["sysid"],
    )
    add_common_options(command)
    command.add_argument(
        "--effects",
        metavar="FOLDER",
        help="effects of your own, beside the catalogue; anywhere on the line",
    )
    command.add_argument(
        "--traceback", action="store_true", help="show Python's traceback of an internal error"
    )
    verbs = command.add_subparsers(dest="verb", metavar="VERB", required=True)
    for add in (
        _add_diagnose,
        _add_fit,
        _add_replay,
        _add_compare,
        _add_effects,
        _add_learn,
        _add_check,
        add_import,
        _add_next,
        _add_open,
        add_prove,
        add_fleet,
    ):
        add(verbs)
    return command


def _add_diagnose(verbs: Verbs) -> None:
    verb = add_verb(
        verbs, "diagnose", "say which physics the twin is missing, where, and how much"
    )
    add_bags(verb)
    add_twin(verb, "the twin file to start from")
    verb.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="DIR",
        help="gets verdict.json, report.html, twin.yaml",
    )
    add_hold(verb)
    add_json(verb)


def _add_fit(verbs: Verbs) -> None:
    verb = add_verb(verbs, "fit", "fit the twin's own parameters, adding no physics")
    add_bags(verb)
    add_twin(verb, "the twin file to start from")
    verb.add_argument(
        "--out", required=True, type=Path, metavar="TWIN.yaml", help="the fitted twin file"
    )
    how = "windows (default), or the thesis's own procedure to compare with"
    verb.add_argument("--method", choices=("windows", "thesis"), default="windows", help=how)
    most = "with --method thesis: runs of the whole recording at most (default: 2000)"
    verb.add_argument("--max-evaluations", type=make_whole_reader(1), metavar="N", help=most)
    add_hold(verb)
    add_json(verb)


def _add_replay(verbs: Verbs) -> None:
    verb = add_verb(verbs, "replay", "say how well a twin runs on recordings")
    add_bags(verb)
    add_twin(verb, "the twin file")
    add_json(verb)


def _add_compare(verbs: Verbs) -> None:
    verb = add_verb(verbs, "compare", "put two twins side by side on recordings")
    add_bags(verb)
    verb.add_argument(
        "--twin", required=True, type=Path, action="append", help="a twin file; give it twice"
    )
    verb.add_argument(
        "--out",
        type=Path,
        metavar="PLOT.png",
        help="draw both runs and their errors (png, svg or pdf)",
    )
    add_json(verb)


def _add_effects(verbs: Verbs) -> None:
    verb = add_verb(verbs, "effects", "list the catalogue of physics beyond the base model")
    add_json(verb)
    what = (
        "say instead what a plan's recording will find and tell apart on a rig; needs "
        "--twin and --plan"
    )
    verb.add_argument("--isolability", action="store_true", help=what)
    verb.add_argument("--twin", type=Path, help="with --isolability: the rig's twin file")
    verb.add_argument(
        "--plan", metavar="PLAN", help="with --isolability: a plan file, or standard (60 s)"
    )
    counts = "with --isolability: counts a turn of the pole's encoder"
    verb.add_argument(
        "--pole-counts", type=make_whole_reader(1), default=4096, metavar="C", help=counts
    )
    step = "with --isolability: one step of the cart's encoder, m"
    verb.add_argument("--cart-step-m", type=read_above_zero, default=57e-6, metavar="M", help=step)


def _add_learn(verbs: Verbs) -> None:
    verb = add_verb(verbs, "learn", "turn the measured laws of a verdict into effects")
    verb.add_argument("verdict", metavar="VERDICT", type=Path, help="verdict.json or its folder")
    verb.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="FOLDER",
        help="gets a Python file a law; give it to every verb as --effects FOLDER",
    )
    verb.add_argument("--name", metavar="NAME", help="of the only effect (default: learned_LAW)")
    add_json(verb)


def _add_check(verbs: Verbs) -> None:
    verb = add_verb(
        verbs,
        "check",
        "ask whether recordings can be of a twin's rig: units, columns, zeros, times",
    )
    add_bags(verb)
    add_twin(verb, "the twin file")
    add_json(verb)


def _add_next(verbs: Verbs) -> None:
    verb = add_verb(
        verbs,
        "next",
        "plan the experiment that best parts what a recording leaves tied, or narrows an interval",
    )
    add_bags(verb)
    add_twin(verb, "the twin file that the diagnosis started from")
    verb.add_argument(
        "--out", required=True, type=Path, metavar="PLAN.yaml", help="the plan file to write"
    )
    verdict = (
        "of an earlier diagnosis of the same recordings, twin.yaml beside it (default: "
        "diagnose them now)"
    )
    verb.add_argument("--verdict", type=Path, metavar="DIR/verdict.json", help=verdict)
    goal = (
        "part what is tied, or narrow the widest interval or the widest band of a measured law "
        "(default: whichever there is)"
    )
    repeat = "play the plan twice, with a rest between: shows how much of the error comes again"
    verb.add_argument("--repeat", action="store_true", help=repeat)
    verb.add_argument("--for", dest="goal", choices=("tie", "interval", "law"), help=goal)
    verb.add_argument(
        "--seconds",
        type=read_seconds,
        default=20.0,
        metavar="T",
        help="length of the plan",
    )
    add_json(verb)


def _add_open(verbs: Verbs) -> None:
    verb = add_verb(verbs, "open", "show the report of a diagnosis, or of a fleet, in the browser")
    verb.add_argument("folder", type=Path, metavar="DIR", help="folder of --out, or its page")
    add_json(verb)
