"""The options of `sysid prove`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_sysid.verbs.fleet_options import add_engine
from pendulum_sysid.verbs.shared_options import add_json, add_verb, read_seconds
from pendulum_twin.command_line import make_whole_reader

if TYPE_CHECKING:
    from pendulum_sysid.verbs.shared_options import Verbs


def add_prove(verbs: Verbs) -> None:
    """Add the verb `prove`."""
    verb = add_verb(
        verbs,
        "prove",
        "conceal physics in emulated rigs, diagnose their recordings blindly, and say how often "
        "it is right",
    )
    _add_series(verb)
    _add_recordings(verb)
    _add_concealed(verb)
    _add_questions(verb)
    add_engine(verb, "--processes")
    add_json(verb)


def _add_series(verb: argparse.ArgumentParser) -> None:
    """Add which rigs are drawn, and where the proof is written."""
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


def _add_recordings(verb: argparse.ArgumentParser) -> None:
    """Add what the recordings are like, and what moves the rigs."""
    verb.add_argument(
        "--pole-counts",
        type=make_whole_reader(1),
        metavar="C",
        help="counts a turn of the pole's encoder (default: 4096)",
    )
    verb.add_argument(
        "--seconds", type=read_seconds, metavar="T", help="length of each recording (default: 60)"
    )
    verb.add_argument(
        "--closed-loop", action="store_true", help="record a controller at work instead of a plan"
    )
    verb.add_argument(
        "--relay",
        action="store_true",
        help="as --closed-loop, with a controller that knows full left, none and full right alone",
    )
    verb.add_argument(
        "--pairs",
        action="store_true",
        help="record and diagnose every rig a second time, under another plan",
    )


def _add_concealed(verb: argparse.ArgumentParser) -> None:
    """Add what the rigs are, and what is concealed in them."""
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
        "--twin",
        type=Path,
        metavar="TWIN",
        help="the nominal rig (default: the INTECO rig by its maker's constants)",
    )


def _add_questions(verb: argparse.ArgumentParser) -> None:
    """Add what else is asked of the recordings: rivals, smaller sizes, worse data."""
    rivals = (
        "ask plain rivals as well, on the same recordings: for names, and for predictions of a "
        "second recording where there is one (needs pysindy, scikit-learn and torch; takes a "
        "minute or two each)"
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
