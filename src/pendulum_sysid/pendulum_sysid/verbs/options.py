"""The verbs of `sysid` and their options."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_sysid.verbs.fleet_options import add_engine, add_fleet
from pendulum_twin.command_line import add_version, make_whole_reader

if TYPE_CHECKING:
    Verbs = argparse._SubParsersAction[argparse.ArgumentParser]

BAG = "a rosbag2 folder or its data file"


def make_parser() -> argparse.ArgumentParser:
    """Make the parser: its namespace holds `verb`, the verb's own `parser`, and its options."""
    command = argparse.ArgumentParser(
        prog="sysid",
        description="Find where a digital twin of a cart-pendulum is wrong, and put it right.",
    )
    add_version(command)
    command.add_argument(
        "--effects",
        metavar="FOLDER",
        help="effects of your own, beside the catalogue; anywhere on the line, of every verb",
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
        _add_import,
        _add_next,
        _add_prove,
        add_fleet,
    ):
        add(verbs)
    return command


def _add_diagnose(verbs: Verbs) -> None:
    verb = _add_verb(
        verbs, "diagnose", "say which physics the twin is missing, where, and how much"
    )
    _add_bags(verb)
    verb.add_argument("--twin", required=True, type=Path, help="the twin file to start from")
    verb.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="DIR",
        help="gets verdict.json, report.html, twin.yaml",
    )
    _add_hold(verb)


def _add_hold(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--hold",
        type=_split_names,
        default=(),
        metavar="NAME[,NAME]",
        help='constants of the rig that are known and stay as they are; "all" for all of them',
    )


def _split_names(text: str) -> tuple[str, ...]:
    return tuple(name.strip() for name in text.split(",") if name.strip())


def _add_fit(verbs: Verbs) -> None:
    verb = _add_verb(verbs, "fit", "fit the twin's own parameters, adding no physics")
    _add_bags(verb)
    verb.add_argument("--twin", required=True, type=Path, help="the twin file to start from")
    verb.add_argument(
        "--out", required=True, type=Path, metavar="TWIN.yaml", help="the fitted twin file"
    )
    how = "windows (default), or the thesis's own procedure to compare with"
    verb.add_argument("--method", choices=("windows", "thesis"), default="windows", help=how)
    most = "with --method thesis: runs of the whole recording at most (default: 2000)"
    verb.add_argument("--max-evaluations", type=make_whole_reader(1), metavar="N", help=most)
    _add_hold(verb)


def _add_replay(verbs: Verbs) -> None:
    verb = _add_verb(verbs, "replay", "say how well a twin runs on a recording")
    _add_bag(verb)
    verb.add_argument("--twin", required=True, type=Path, help="the twin file")
    verb.add_argument("--json", action="store_true", help="print one JSON object")


def _add_compare(verbs: Verbs) -> None:
    verb = _add_verb(verbs, "compare", "put two twins side by side on a recording")
    _add_bag(verb)
    verb.add_argument(
        "--twin", required=True, type=Path, action="append", help="a twin file; give it twice"
    )
    verb.add_argument(
        "--out",
        type=Path,
        metavar="PLOT.png",
        help="draw both runs and their errors (png, svg or pdf)",
    )


def _add_effects(verbs: Verbs) -> None:
    verb = _add_verb(verbs, "effects", "list the catalogue of physics beyond the base model")
    verb.add_argument("--json", action="store_true", help="print one JSON object")
    what = (
        "say instead what a plan's recording will find and tell apart on a rig; needs "
        "--twin and --plan"
    )
    verb.add_argument("--isolability", action="store_true", help=what)
    verb.add_argument("--twin", type=Path, help="with --isolability: the rig's twin file")
    verb.add_argument(
        "--plan", metavar="PLAN", help="with --isolability: a plan file, or standard (60 s)"
    )
    counts = "with --isolability: counts a turn of the pole's encoder (default: 4096)"
    verb.add_argument(
        "--pole-counts", type=make_whole_reader(1), default=4096, metavar="C", help=counts
    )
    step = "with --isolability: one step of the cart's encoder, m (default: 57e-6)"
    verb.add_argument(
        "--cart-step-m", type=_read_above_zero, default=57e-6, metavar="M", help=step
    )


def _add_learn(verbs: Verbs) -> None:
    verb = _add_verb(verbs, "learn", "turn the measured laws of a verdict into effects")
    verb.add_argument("verdict", metavar="VERDICT", type=Path, help="verdict.json or its folder")
    verb.add_argument(
        "--out",
        required=True,
        type=Path,
        metavar="FOLDER",
        help="gets a Python file a law; give it to every verb as --effects FOLDER",
    )
    verb.add_argument("--name", metavar="NAME", help="of the effect (default: learned_LAW)")


def _add_check(verbs: Verbs) -> None:
    verb = _add_verb(
        verbs,
        "check",
        "ask whether recordings can be of a twin's rig: units, columns, zeros, times",
    )
    _add_bags(verb)
    verb.add_argument("--twin", required=True, type=Path, help="the twin file")
    verb.add_argument("--json", action="store_true", help="print one JSON object")


def _add_import(verbs: Verbs) -> None:
    verb = _add_verb(
        verbs,
        "import",
        "turn columns of a CSV, .mat, .npz or .parquet file, or a ROS 1 bag, into a recording",
    )
    verb.add_argument(
        "csv",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="a file whose first line names its columns; without, give their numbers from 1",
    )
    out = "the rosbag2 folder to write; with several files, the folder of one for each"
    verb.add_argument("--out", required=True, type=Path, metavar="BAG", help=out)
    for option, what in (
        ("time", "time of each sample"),
        ("command", "what was sent to the drive"),
        ("cart", "cart position"),
        ("pole", "pole angle, counterclockwise"),
        ("cart-velocity", "reported velocity of the cart, in its unit a second"),
        ("pole-velocity", "reported rate of the pole, in its unit a second"),
        ("sin", "sine of the pole's angle, with --cos in place of --pole"),
        ("cos", "cosine of the pole's angle"),
    ):
        verb.add_argument(f"--{option}", metavar="COLUMN", help=what)
    verb.add_argument(
        "--segment",
        metavar="COLUMN",
        help="number of the run that a row belongs to; each run becomes a recording in BAG/",
    )
    verb.add_argument(
        "--join",
        type=Path,
        metavar="FILE",
        help="the file that holds the command, with times of the same clock",
    )
    verb.add_argument(
        "--join-time",
        metavar="COLUMN",
        help="time of each command in that file (default: the column named by --time)",
    )
    verb.add_argument(
        "--rate",
        dest="rate_hz",
        type=_read_above_zero,
        metavar="HZ",
        help="rows a second, for a file without times",
    )
    since = "default: s, or what times since 1970 show"
    for option, units, default in (
        ("length-unit", ("m", "cm", "mm"), "m"),
        ("angle-unit", ("rad", "deg", "turn"), "rad"),
        ("time-unit", ("s", "ms", "us", "ns"), None),
        ("command-unit", ("one", "percent", "per_mille"), "one"),
    ):
        said = f"default: {default}" if default else since
        verb.add_argument(f"--{option}", choices=units, default=default, help=said)
    verb.add_argument(
        "--pole-zero",
        choices=("up", "down"),
        default="up",
        help="where the angle is 0 (default: up)",
    )
    verb.add_argument(
        "--skip",
        type=_read_seconds,
        default=0.0,
        metavar="S",
        help="leave out the first S seconds",
    )
    verb.add_argument("--invert-cart", action="store_true", help="turn the cart's sign round")
    verb.add_argument("--invert-pole", action="store_true", help="turn the pole's sign round")


def _add_next(verbs: Verbs) -> None:
    verb = _add_verb(
        verbs,
        "next",
        "plan the experiment that best parts what a recording leaves tied, or narrows an interval",
    )
    _add_bags(verb)
    verb.add_argument(
        "--twin", required=True, type=Path, help="the twin file that the diagnosis started from"
    )
    verb.add_argument(
        "--out", required=True, type=Path, metavar="PLAN.yaml", help="the plan file to write"
    )
    verdict = (
        "of an earlier diagnosis of the same recordings, twin.yaml beside it (default: "
        "diagnose them now)"
    )
    verb.add_argument("--verdict", type=Path, metavar="DIR/verdict.json", help=verdict)
    goal = "part what is tied, or narrow the widest interval (default: whichever there is)"
    verb.add_argument("--for", dest="goal", choices=("tie", "interval"), help=goal)
    verb.add_argument(
        "--seconds",
        type=_read_seconds,
        default=20.0,
        metavar="T",
        help="length of the plan (default: 20)",
    )


def _add_prove(verbs: Verbs) -> None:
    verb = _add_verb(
        verbs,
        "prove",
        "conceal physics in emulated rigs, diagnose their recordings blindly, and say how often "
        "it is right",
    )
    verb.add_argument(
        "--trials", required=True, type=make_whole_reader(1), metavar="N", help="how many rigs"
    )
    verb.add_argument(
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
    verb.add_argument("--out", type=Path, metavar="DIR", help=out)
    verb.add_argument(
        "--pole-counts",
        type=make_whole_reader(1),
        metavar="C",
        help="counts a turn of the pole's encoder (default: 4096)",
    )
    verb.add_argument(
        "--seconds", type=_read_seconds, metavar="T", help="length of each recording (default: 60)"
    )
    verb.add_argument(
        "--closed-loop", action="store_true", help="record a controller at work instead of a plan"
    )
    verb.add_argument(
        "--pairs",
        action="store_true",
        help="record and diagnose every rig a second time, under another plan",
    )
    verb.add_argument(
        "--rest",
        action="store_true",
        help="let small physics that nobody asks for be always on, as on real rigs",
    )
    kinds = "shares of nothing, single, pair, triple, quadruple, unlisted (15, 40, 20, 10, 0, 15)"
    verb.add_argument("--kinds", metavar="KIND:SHARE,...", help=kinds)
    verb.add_argument(
        "--unlisted",
        dest="kinds",
        action="store_const",
        const="unlisted:1",
        help="conceal only physics that the catalogue does not hold",
    )
    verb.add_argument(
        "--twin", type=Path, metavar="TWIN", help="the nominal rig (default: config/inteco.yaml)"
    )
    rivals = (
        "name by plain rivals as well, on the same recordings (needs pysindy; takes half "
        "a minute each)"
    )
    verb.add_argument(
        "--rivals", action=argparse.BooleanOptionalAction, default=False, help=rivals
    )
    dose = (
        "also make every effect smaller until it is not found any more, so many "
        "recordings each (2)"
    )
    verb.add_argument(
        "--dose-response",
        nargs="?",
        type=make_whole_reader(1),
        const=2,
        default=0,
        metavar="TRIES",
        help=dose,
    )
    degrade = (
        "degrade the recordings instead, as computers and sensors do, and say how often the "
        "answer is right, says less or is wrong (all kinds, or those named)"
    )
    verb.add_argument("--degrade", nargs="?", const="", metavar="KIND,...", help=degrade)
    add_engine(verb, "--processes")


def _add_verb(verbs: Verbs, name: str, sentence: str) -> argparse.ArgumentParser:
    verb = verbs.add_parser(
        name, help=sentence, description=sentence[0].upper() + sentence[1:] + "."
    )
    verb.add_argument(
        "--traceback", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS
    )
    verb.set_defaults(parser=verb)
    return verb


def _add_bags(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("bag", nargs="+", type=Path, metavar="BAG", help=BAG)
    _add_topics(verb)


def _add_bag(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("bag", type=Path, metavar="BAG", help=BAG)
    _add_topics(verb)


def _add_topics(verb: argparse.ArgumentParser) -> None:
    verb.add_argument(
        "--state-topic", metavar="T", help="topic of the states (default: /rig/joint_states)"
    )
    verb.add_argument(
        "--command-topic", metavar="T", help="topic of the commands (default: /rig/pwm)"
    )


def _read_above_zero(text: str) -> float:
    number = _read_seconds(text)
    if number == 0.0:
        raise argparse.ArgumentTypeError(f"expected a number above 0, found {text!r}")
    return number


def _read_seconds(text: str) -> float:
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    if not 0.0 <= seconds < math.inf:
        raise argparse.ArgumentTypeError(f"expected a number of seconds from 0 on, found {text!r}")
    return seconds
