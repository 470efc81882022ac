"""The verbs of `sysid` and their options."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_twin.command_line import make_whole_reader

if TYPE_CHECKING:
    Verbs = argparse._SubParsersAction[argparse.ArgumentParser]

BAG = "a rosbag2 folder or its data file"


def make_parser() -> argparse.ArgumentParser:
    """Make the parser: its namespace holds `verb`, the verb's own `parser`, and its options."""
    command = argparse.ArgumentParser(
        prog="sysid",
        description="Find where a digital twin of a cart-pendulum is wrong, and put it right.",
    )
    command.add_argument(
        "--traceback", action="store_true", help="show Python's traceback of an internal error"
    )
    verbs = command.add_subparsers(dest="verb", metavar="VERB", required=True)
    for add in (_diagnose, _fit, _replay, _compare, _effects, _import, _next, _prove):
        add(verbs)
    return command


def _diagnose(verbs: Verbs) -> None:
    one = _verb(verbs, "diagnose", "say which physics the twin is missing, where, and how much")
    _bags(one)
    one.add_argument("--twin", required=True, type=Path, help="the twin file to start from")
    one.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="DIR",
        help="gets verdict.json, report.html, twin.yaml",
    )


def _fit(verbs: Verbs) -> None:
    one = _verb(verbs, "fit", "fit the twin's own parameters, adding no physics")
    _bags(one)
    one.add_argument("--twin", required=True, type=Path, help="the twin file to start from")
    one.add_argument(
        "--out", required=True, type=Path, metavar="TWIN.yaml", help="the fitted twin file"
    )
    how = "windows (default), or the thesis's own procedure to compare with"
    one.add_argument("--method", choices=("windows", "thesis"), default="windows", help=how)
    most = "with --method thesis: runs of the whole recording at most (default: 2000)"
    one.add_argument("--max-evaluations", type=make_whole_reader(1), metavar="N", help=most)


def _replay(verbs: Verbs) -> None:
    one = _verb(verbs, "replay", "say how well a twin runs on a recording")
    _bag(one)
    one.add_argument("--twin", required=True, type=Path, help="the twin file")
    one.add_argument("--json", action="store_true", help="print one JSON object")


def _compare(verbs: Verbs) -> None:
    one = _verb(verbs, "compare", "put two twins side by side on a recording")
    _bag(one)
    one.add_argument(
        "--twin", required=True, type=Path, action="append", help="a twin file; give it twice"
    )
    one.add_argument(
        "--out",
        type=Path,
        metavar="PLOT.png",
        help="draw both runs and their errors (png, svg or pdf)",
    )


def _effects(verbs: Verbs) -> None:
    one = _verb(verbs, "effects", "list the catalogue of physics beyond the base model")
    one.add_argument("--json", action="store_true", help="print one JSON object")
    what = (
        "say instead what a plan's recording will find and tell apart on a rig; needs "
        "--twin and --plan"
    )
    one.add_argument("--isolability", action="store_true", help=what)
    one.add_argument("--twin", type=Path, help="with --isolability: the rig's twin file")
    one.add_argument(
        "--plan", metavar="PLAN", help="with --isolability: a plan file, or standard (60 s)"
    )
    counts = "with --isolability: counts a turn of the pole's encoder (default: 4096)"
    one.add_argument(
        "--pole-counts", type=make_whole_reader(1), default=4096, metavar="C", help=counts
    )
    step = "with --isolability: one step of the cart's encoder, m (default: 57e-6)"
    one.add_argument("--cart-step-m", type=_above_zero, default=57e-6, metavar="M", help=step)


def _import(verbs: Verbs) -> None:
    one = _verb(
        verbs, "import", "turn columns of a CSV file into a recording, SI units taken for granted"
    )
    one.add_argument(
        "csv", type=Path, metavar="FILE.csv", help="a CSV file whose first line names its columns"
    )
    one.add_argument(
        "--out", required=True, type=Path, metavar="BAG", help="the rosbag2 folder to write"
    )
    one.add_argument("--time", required=True, metavar="COLUMN", help="time of each sample, s")
    one.add_argument("--command", metavar="COLUMN", help="what was sent to the drive")
    one.add_argument("--cart", metavar="COLUMN", help="cart position, m")
    one.add_argument("--pole", metavar="COLUMN", help="pole angle, rad, counterclockwise")
    one.add_argument(
        "--pole-zero",
        choices=("up", "down"),
        default="up",
        help="where the angle is 0 (default: up)",
    )
    one.add_argument(
        "--skip", type=_seconds, default=0.0, metavar="S", help="leave out the first S seconds"
    )
    one.add_argument("--invert-cart", action="store_true", help="turn the cart's sign round")
    one.add_argument("--invert-pole", action="store_true", help="turn the pole's sign round")


def _next(verbs: Verbs) -> None:
    one = _verb(
        verbs,
        "next",
        "plan the experiment that best parts what a recording leaves tied, or narrows an interval",
    )
    _bags(one)
    one.add_argument(
        "--twin", required=True, type=Path, help="the twin file that the diagnosis started from"
    )
    one.add_argument(
        "--out", required=True, type=Path, metavar="PLAN.yaml", help="the plan file to write"
    )
    verdict = (
        "of an earlier diagnosis of the same recordings, twin.yaml beside it (default: "
        "diagnose them now)"
    )
    one.add_argument("--verdict", type=Path, metavar="DIR/verdict.json", help=verdict)
    goal = "part what is tied, or narrow the widest interval (default: whichever there is)"
    one.add_argument("--for", dest="goal", choices=("tie", "interval"), help=goal)
    one.add_argument(
        "--seconds",
        type=_seconds,
        default=20.0,
        metavar="T",
        help="length of the plan (default: 20)",
    )


def _prove(verbs: Verbs) -> None:
    one = _verb(
        verbs,
        "prove",
        "conceal physics in emulated rigs, diagnose their recordings blindly, and say how often "
        "it is right",
    )
    one.add_argument(
        "--trials", required=True, type=make_whole_reader(1), metavar="N", help="how many rigs"
    )
    one.add_argument(
        "--seed",
        required=True,
        type=make_whole_reader(),
        metavar="S",
        help="what they are drawn from",
    )
    out = (
        "gets proof.html, proof.json and every recording; goes on from what is there "
        "(default: proof_seed_S)"
    )
    one.add_argument("--out", type=Path, metavar="DIR", help=out)
    one.add_argument(
        "--pole-counts",
        type=make_whole_reader(1),
        metavar="C",
        help="counts a turn of the pole's encoder (default: 4096)",
    )
    one.add_argument(
        "--seconds", type=_seconds, metavar="T", help="length of each recording (default: 60)"
    )
    one.add_argument(
        "--closed-loop", action="store_true", help="record a controller at work instead of a plan"
    )
    kinds = "how many of nothing, single, pair, triple, unlisted (default: 15, 40, 20, 10, 15)"
    one.add_argument("--kinds", metavar="KIND:SHARE,...", help=kinds)
    one.add_argument(
        "--twin", type=Path, metavar="TWIN", help="the nominal rig (default: config/inteco.yaml)"
    )
    rivals = (
        "name by plain rivals as well, on the same recordings (needs pysindy; takes half "
        "a minute each)"
    )
    one.add_argument("--rivals", action=argparse.BooleanOptionalAction, default=False, help=rivals)
    dose = (
        "also make every effect smaller until it is not found any more, so many "
        "recordings each (2)"
    )
    one.add_argument(
        "--dose-response",
        nargs="?",
        type=make_whole_reader(1),
        const=2,
        default=0,
        metavar="TRIES",
        help=dose,
    )
    one.add_argument(
        "--processes",
        type=make_whole_reader(1),
        default=2,
        metavar="P",
        help="recordings examined side by side (default: 2)",
    )


def _verb(verbs: Verbs, name: str, sentence: str) -> argparse.ArgumentParser:
    one = verbs.add_parser(
        name, help=sentence, description=sentence[0].upper() + sentence[1:] + "."
    )
    one.add_argument(
        "--traceback", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )
    one.set_defaults(parser=one)
    return one


def _bags(one: argparse.ArgumentParser) -> None:
    one.add_argument("bag", nargs="+", type=Path, metavar="BAG", help=BAG)
    _topics(one)


def _bag(one: argparse.ArgumentParser) -> None:
    one.add_argument("bag", type=Path, metavar="BAG", help=BAG)
    _topics(one)


def _topics(one: argparse.ArgumentParser) -> None:
    one.add_argument(
        "--state-topic", metavar="T", help="topic of the states (default: /rig/joint_states)"
    )
    one.add_argument(
        "--command-topic", metavar="T", help="topic of the commands (default: /rig/pwm)"
    )


def _above_zero(text: str) -> float:
    number = _seconds(text)
    if number == 0.0:
        raise argparse.ArgumentTypeError(f"expected a number above 0, found {text!r}")
    return number


def _seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 <= seconds < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number of seconds from 0 on, found {text!r}")
    return seconds
