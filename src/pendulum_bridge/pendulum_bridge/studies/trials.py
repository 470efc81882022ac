"""Record trials of a diagnosis: emulated rigs with concealed physics, a folder each.

The folder of a trial has bag/ (the recording), seal.json (the truth), twin.yaml (the nominal twin:
wrong constants, no effects) and trial.json (its options); for unlisted physics, and with --pairs,
also other/ (the same rig under another plan, on which the improved twin is judged). With --rest
small physics that nobody asks for is always on, as on real rigs. The path of a trial is printed
when the folder is complete. Trial k of a seed is the same, however many are recorded. Run as
`python -m pendulum_bridge.studies.trials --out DIR --trials N --seed S`.
"""

from __future__ import annotations

import argparse
import json
import shutil
import sys
import tempfile
from dataclasses import replace
from pathlib import Path

from pendulum_bridge.emulator.concealable import BY_NAME
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import write_seal
from pendulum_bridge.emulator.sensors import Encoders
from pendulum_bridge.emulator.session import play_plan, record_rig
from pendulum_bridge.emulator.unlisted.table import BY_NAME as UNLISTED
from pendulum_bridge.recording.bag_writer import Log, write_bag
from pendulum_bridge.studies.trial.controller import Controller, make_tuning
from pendulum_bridge.studies.trial.mix import USUAL_SHARES, parse_shares
from pendulum_bridge.studies.trial.trial import Trial, add_rest, draw_trial, draw_trial_with
from pendulum_twin.command_line import as_option, make_number_reader, make_whole_reader
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically
from pendulum_twin.inteco import DEFAULT, load_twin_or_inteco
from pendulum_twin.model import Twin, save_twin
from pendulum_twin.parser import Parser, add_common_options, complete
from pendulum_twin.plans.excitation import make_standard_plan
from pendulum_twin.plans.plan_file import make_excitation, read_plan
from pendulum_twin.plans.waveforms import make_envelope
from pendulum_twin.schemas import TRIAL
from pendulum_twin.suggest import add_hint


def main(arguments: list[str] | None = None) -> int:
    """Record all trials and return 0; return 1 with a sentence on stderr when a trial fails."""
    options = parse_options(arguments)
    try:
        nominal = load_twin_or_inteco(options.twin)
        for number in range(options.first, options.first + options.trials):
            folder = record_trial(_draw_trial(number, options, nominal), nominal, options)
            if not options.quiet:
                print(folder, flush=True)
    except (BadInputError, OSError) as error:
        print(f"trials: {error}", file=sys.stderr)
        return 1
    return 0


def record_trial(trial: Trial, nominal: Twin, options: argparse.Namespace) -> Path:
    """Write the trial's folder whole or not at all, and return it.

    Raises BadInputError when the folder exists.
    """
    folder: Path = options.out / f"trial_{trial.number:04d}"
    if folder.exists():
        raise BadInputError(
            f"{folder}: expected no folder there, found one: trials are not overwritten"
        )
    log = _record_log(trial, nominal, options)
    other = None
    if trial.kind == "unlisted" or options.pairs:
        other = _record_log(replace(trial, seed=trial.seed + 1), nominal, options)
    options.out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=options.out, prefix=f".{folder.name}.") as temporary:
        complete = Path(temporary) / folder.name
        write_bag(log, complete / "bag")
        if other is not None:
            write_bag(other, complete / "other")
        write_seal(trial.concealed, complete / "seal.json")
        save_twin(Twin(f"{nominal.name}_nominal", nominal.rig), complete / "twin.yaml")
        write_atomically(
            complete / "trial.json", json.dumps(_describe_trial(trial, options), indent=2) + "\n"
        )
        shutil.move(complete, folder)
    return folder


def _record_log(trial: Trial, nominal: Twin, options: argparse.Namespace) -> Log:
    rate_hz = options.rate_hz if options.plan is None else read_plan(options.plan).rate_hz
    rig = EmulatedRig(trial.concealed, rate_hz, Encoders(options.pole_counts), trial.seed)
    if options.closed_loop or options.relay:
        controller = Controller(
            make_tuning(nominal.rig, options.seconds, rig.period_s, trial.seed, options.relay)
        )
        return record_rig(rig, controller, round(options.seconds * options.rate_hz))
    room = make_envelope(nominal.rig)
    if options.plan is not None:
        return play_plan(rig, make_excitation(read_plan(options.plan), room))
    return play_plan(rig, make_standard_plan(room, options.seconds, options.rate_hz, trial.seed))


def _describe_trial(trial: Trial, options: argparse.Namespace) -> dict[str, object]:
    return {
        "schema": TRIAL,
        "kind": trial.kind,
        "seed": trial.seed,
        "pole_counts": options.pole_counts,
        "seconds": options.seconds,
        "closed_loop": options.closed_loop or options.relay,
        "relay": options.relay,
        "size_factor": options.size_factor,
        "pairs": options.pairs,
    }


def _draw_trial(number: int, options: argparse.Namespace, nominal: Twin) -> Trial:
    how = (nominal.rig, options.size_factor)
    trial = (
        draw_trial_with(number, options.seed, options.effects, *how)
        if options.effects
        else draw_trial(number, options.seed, options.kinds, *how)
    )
    return add_rest(trial) if options.rest else trial


def parse_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="trials",
        description=__doc__,
        examples=(
            "python -m pendulum_bridge.studies.trials --out out/trials --trials 3 --seed 5",
            "python -m pendulum_bridge.studies.trials --out out/c --trials 1 --seed 5 "
            "--effects cogging",
        ),
    )
    add_common_options(parser)
    _add_series(parser)
    _add_recording(parser)
    _add_concealed(parser)
    _add_motion(parser)
    _add_rig(parser)
    complete(parser)
    return parser.parse_args(arguments)


def _add_series(parser: Parser) -> None:
    """Add which trials are recorded, and where they are written."""
    parser.add_argument("--out", type=Path, required=True, help="folder for the trials' folders")
    parser.add_argument(
        "--trials", type=make_whole_reader(), required=True, metavar="N", help="how many"
    )
    parser.add_argument(
        "--seed",
        type=make_whole_reader(),
        required=True,
        metavar="S",
        help="what they are drawn from",
    )
    parser.add_argument(
        "--first", type=make_whole_reader(), default=0, metavar="K", help="number of the first"
    )


def _add_recording(parser: Parser) -> None:
    """Add how long a recording is, and how finely it is sampled."""
    parser.add_argument(
        "--seconds",
        type=make_number_reader(40, 36000),
        default=60.0,
        metavar="S",
        help="length of a recording",
    )
    parser.add_argument(
        "--rate-hz",
        type=make_number_reader(20, 10_000),
        default=100.0,
        metavar="HZ",
        help="samples a second",
    )
    parser.add_argument(
        "--pole-counts",
        type=make_whole_reader(),
        default=4096,
        metavar="N",
        help="the pole's encoder's counts a turn",
    )


def _add_concealed(parser: Parser) -> None:
    """Add what is concealed in the rigs."""
    usual = ",".join(f"{kind}:{share}" for kind, share in USUAL_SHARES.items())
    parser.add_argument(
        "--kinds",
        type=as_option(parse_shares),
        default=USUAL_SHARES,
        metavar="KIND:SHARE,...",
        help=f"kinds and their shares (default: {usual})",
    )
    parser.add_argument(
        "--effects",
        type=as_option(_parse_effects),
        nargs="+",
        metavar="A+B",
        help="conceal these, sets taking turns, instead of kinds",
    )
    parser.add_argument(
        "--size-factor",
        type=make_number_reader(0, 100),
        default=1.0,
        metavar="F",
        help="times every drawn size",
    )


def _add_motion(parser: Parser) -> None:
    """Add what moves the rigs."""
    parser.add_argument(
        "--plan",
        type=Path,
        metavar="PLAN.yaml",
        help="play this plan, at its own rate, instead of the standard plan",
    )
    parser.add_argument(
        "--closed-loop",
        action="store_true",
        help="record a controller at work instead of the standard plan",
    )
    parser.add_argument(
        "--relay",
        action="store_true",
        help="as --closed-loop, with a controller that knows full left, none and full right alone",
    )
    parser.add_argument(
        "--pairs",
        action="store_true",
        help="record every rig a second time, under another plan",
    )


def _add_rig(parser: Parser) -> None:
    """Add the nominal rig, and what real rigs have beside it."""
    parser.add_argument(
        "--rest",
        action="store_true",
        help="let small physics that nobody asks for be always on, as on real rigs",
    )
    parser.add_argument(
        "--twin",
        type=Path,
        help=f"twin file of the nominal rig {DEFAULT}",
    )


def _parse_effects(text: str) -> tuple[str, ...]:
    names = tuple(text.split("+"))
    for name in names:
        if name not in BY_NAME and name not in UNLISTED:
            known = ", ".join([*BY_NAME, *UNLISTED])
            raise BadInputError(
                f"expected effects that can be concealed ({known}), found {name!r}"
                f"{add_hint(name, [*BY_NAME, *UNLISTED])}"
            )
    return names


if __name__ == "__main__":
    sys.exit(main())
