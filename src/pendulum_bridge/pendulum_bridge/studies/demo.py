"""The whole job with no hardware, from concealed physics in an emulated rig to the open seal.

The rig is driven, excited and recorded over a ROS graph as a real rig is, and the recording is
diagnosed by `sysid diagnose`. Run as `python -m pendulum_bridge.studies.demo --out out/demo`.
"""

from __future__ import annotations

import argparse
import os
import secrets
import shutil
import sys
from pathlib import Path

from pendulum_bridge.emulator.seal import open_seal
from pendulum_bridge.studies.comparison import format_comparison, read_verdict
from pendulum_bridge.studies.demo_folder import DemoFacts, make_room, write_facts
from pendulum_bridge.studies.emulated_graph import (
    APPLIED_TOPIC,
    LONGEST_START_S,
    PlanGivenUpError,
    list_node_arguments,
    make_environment,
    play_plan,
    start_recorder,
    start_rig,
)
from pendulum_bridge.studies.lost_samples import SamplesLostError, check_samples
from pendulum_bridge.studies.programs import SCRIPTS, Programs, wait_for
from pendulum_sysid.cli import main as run_sysid
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.errors import WorkerError
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parser import Parser, add_common_options, complete

NOMINAL = Path("config/inteco.yaml")


def main(arguments: list[str] | None = None) -> int:
    """Run the demo and return 0; return 1, with the reason on stderr, when it gets no answer.

    Returns 130 when Ctrl-C ended it.
    """
    options = parse_options(arguments)
    ended = "all that it had started has ended"
    return run_command("demo", lambda: _run_demo(options), ended)


def _run_demo(options: argparse.Namespace) -> None:
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    facts = DemoFacts(seed, options.effects, tuple(_list_options(options)))
    nominal = load_twin(options.twin)
    kept = make_room(options.out)
    if kept is not None and not options.quiet:
        print(f"The earlier demo is kept in {kept}", flush=True)
    write_facts(facts, options.out)
    doubt = _record_calmly(options, nominal, seed)
    diagnose(options.out, options.quiet)
    print(format_answer(options.out, nominal), flush=True)
    if doubt:
        advice = "let it come to rest before you judge the diagnosis"
        print(f"demo: {doubt}: {advice}", file=sys.stderr, flush=True)
    if not options.quiet:
        sysid = os.path.relpath(SCRIPTS / "sysid")
        print(f"Show it: {sysid} open {options.out}\nAgain: {facts.command}")


def _record_calmly(options: argparse.Namespace, nominal: Twin, seed: int) -> str:
    """Record, once more where this computer was too busy; return what still spoils the second."""
    try:
        record(options, nominal, seed)
    except (PlanGivenUpError, SamplesLostError) as error:
        print(f"demo: {error}; recording once more", file=sys.stderr, flush=True)
        remove_recording(options.out)
    else:
        return ""
    try:
        record(options, nominal, seed)
    except SamplesLostError as error:
        return str(error)
    return ""


def record(options: argparse.Namespace, nominal: Twin, seed: int) -> None:
    """Write seal, recording and nominal twin into `options.out`.

    Raises PlanGivenUpError or SamplesLostError where this computer was too busy.

    nominal: the twin from whose rig the concealed rig is drawn; its effects are left out.
    seed: decides what is concealed.
    """
    out, effects, view = options.out, options.effects, options.view
    if not options.quiet:
        print(
            f"Concealing {effects} effect(s) and wrong parameters in an emulated rig "
            f"(again: --seed {seed})",
            flush=True,
        )
    file = out / "nominal_twin.yaml"
    save_twin(Twin(f"{nominal.name}_nominal", nominal.rig), file)
    concealing = ("--conceal", seed, "--effects", effects, "--seal", out / "seal.json")
    with Programs(out / "logs", make_environment()) as programs:
        start_rig(programs, file, *concealing)
        if view:
            _start_view(programs, file)
        start_recorder(programs, out / "recording", file, f"demo, seed {seed}")
        play_plan(
            programs,
            twin_file=file,
            plan=options.plan or "",
            twin="/twin" if view else "",
            listeners=2 + view,
        )
    if not options.quiet:
        print(f"Recorded: {out / 'recording'}", flush=True)
    check_samples(out / "recording")


def remove_recording(out: Path) -> None:
    """Remove what `record` has written, for another recording under the same seed."""
    (out / "seal.json").unlink(missing_ok=True)
    for folder in ("recording", "logs"):
        shutil.rmtree(out / folder, ignore_errors=True)


def _start_view(programs: Programs, twin_file: Path) -> None:
    programs.start("twin_node", *list_node_arguments("/twin", twin=twin_file))
    page = programs.start("view_node", *list_node_arguments("/", recordings=""))
    wait_for(page, "\nhttp://", LONGEST_START_S)  # the address, on a line of its own
    print(page.output.splitlines()[-1], flush=True)


def diagnose(out: Path, quiet: bool) -> None:
    """Run `sysid diagnose` on the recording; raise WorkerError when it fails."""
    files = ["--twin", out / "nominal_twin.yaml", "--out", out / "diagnosis"]
    status = run_sysid(
        [str(word) for word in ("diagnose", out / "recording", *files)]
        + ["--command-topic", APPLIED_TOPIC, *(["--quiet"] if quiet else [])]
    )
    if status:
        raise WorkerError(f"sysid diagnose ended with status {status}; what it said stands above")


def format_answer(out: Path, nominal: Twin) -> str:
    """Open the seal and return it beside the verdict, with the path of the report."""
    verdict = read_verdict(out / "diagnosis" / "verdict.json")
    comparison = format_comparison(open_seal(out / "seal.json"), nominal.rig, verdict)
    return f"\n{comparison}\nReport: {out / 'diagnosis' / 'report.html'}"


def parse_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the command line's options; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="demo",
        description=(__doc__ or "").split("\n\n")[0],
        examples=(
            "python -m pendulum_bridge.studies.demo --out out/demo --seed 13 --effects 2",
            'make demo ARGS="--seed 13 --effects 2"',
        ),
    )
    add_common_options(parser)
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="folder for recording, seal and diagnosis; an earlier demo there is renamed",
    )
    parser.add_argument(
        "--seed", type=make_whole_reader(), help="what is concealed; by default another every time"
    )
    parser.add_argument(
        "--effects",
        type=make_whole_reader(),
        default=1,
        help="how many effects are concealed",
    )
    parser.add_argument("--twin", type=Path, default=NOMINAL, help="the rig's nominal constants")
    parser.add_argument("--plan", type=Path, help="a plan file; by default the standard minute")
    parser.add_argument(
        "--view", action="store_true", help="serve the page that shows rig and twin live"
    )
    complete(parser)
    return parser.parse_args(arguments)


def _list_options(options: argparse.Namespace) -> list[str]:
    """Return the options that make the same demo again, without --out and --seed."""
    words = ["--effects", str(options.effects)]
    if options.twin != NOMINAL:
        words += ["--twin", str(options.twin)]
    if options.plan is not None:
        words += ["--plan", str(options.plan)]
    return words + (["--view"] if options.view else [])


if __name__ == "__main__":
    sys.exit(main())
