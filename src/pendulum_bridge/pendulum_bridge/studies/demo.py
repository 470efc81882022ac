"""The whole job with no hardware, from concealed physics in an emulated rig to the open seal.

The rig is driven, excited and recorded over a ROS graph as a real rig is, and the recording is
diagnosed by `sysid diagnose`. Run as `python -m pendulum_bridge.studies.demo --out out/demo`.
"""

from __future__ import annotations

import argparse
import os
import secrets
import shutil
import socket
import sys
from pathlib import Path

from pendulum_bridge.emulator.seal import open_seal
from pendulum_bridge.studies.comparison import format_comparison, read_verdict
from pendulum_bridge.studies.demo_folder import DemoFacts, make_room, write_facts
from pendulum_bridge.studies.lost_samples import SamplesLostError, check_samples
from pendulum_bridge.studies.programs import SCRIPTS, Programs, wait_for, wait_until_done
from pendulum_bridge.wire.udp import Address
from pendulum_sysid.cli import main as run_sysid
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin, save_twin
from pendulum_twin.parser import Parser, add_common_options, complete

STATES_TOPIC = "/rig/joint_states"
# The command after the driver's limits (magnitude and rate of change): what the rig received.
APPLIED_TOPIC = "/rig/applied_pwm"
NOMINAL = Path("config/inteco.yaml")
INTERRUPTED = 130  # exit status after Ctrl-C, as shells have it
LOOPBACK = "127.0.0.1"
LONGEST_START_S = 180.0  # a program that takes longer to start is stuck, on any machine
LONGEST_PLAY_S = 300.0  # the plan lasts a minute; a busy machine takes longer to start and end it
# low ROS domains are what people choose; higher ones need ports that the system gives to others
DOMAIN_IDS = range(20, 100)


class PlanGivenUpError(BadInputError):
    """The excitation ended before its plan: a busy computer drives a rig late."""


def main(arguments: list[str] | None = None) -> int:
    """Run the demo and return 0; return 1, with the reason on stderr, when it gets no answer.

    Returns 130 when Ctrl-C ended it.
    """
    options = parse_options(arguments)
    ended = "all that it had started has ended"
    return run_command("demo", lambda: _run_demo(options), ended, INTERRUPTED)


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
    with Programs(out / "logs", _make_environment()) as programs:
        _start_rig(
            programs, file, ("--conceal", seed, "--effects", effects, "--seal", out / "seal.json")
        )
        if view:
            _start_view(programs, file)
        recorder = programs.start(
            "recorder_node",
            *_list_node_arguments(
                "/", out=out / "recording", twin=file, note=f"demo, seed {seed}"
            ),
        )
        wait_for(recorder, f"hears {STATES_TOPIC}", LONGEST_START_S)
        _play_plan(
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


def _start_rig(programs: Programs, twin_file: Path, concealing: tuple[object, ...]) -> None:
    """Start the emulated rig and its driver on free ports; return when both run."""
    rig, user = (Address(LOOPBACK, port) for port in _find_free_ports())
    emulator = programs.start(
        "rig_emulator", "--twin", twin_file, "--listen", rig, "--send", user, *concealing
    )
    wait_for(emulator, "listens on", LONGEST_START_S)
    ports = {"rig_port": rig.port, "listen_port": user.port}
    settings = {"twin": twin_file, "emulated": "true", **ports}
    driver = programs.start("driver_node", *_list_node_arguments("/rig", **settings))
    wait_for(driver, "drives", LONGEST_START_S)


def _start_view(programs: Programs, twin_file: Path) -> None:
    programs.start("twin_node", *_list_node_arguments("/twin", twin=twin_file))
    page = programs.start("view_node", *_list_node_arguments("/", recordings=""))
    wait_for(page, "\nhttp://", LONGEST_START_S)  # the address, on a line of its own
    print(page.output.splitlines()[-1], flush=True)


def _play_plan(programs: Programs, **settings: object) -> None:
    """Play the plan to the rig; the excitation node prints its progress to the terminal.

    The rig is not reset first: the emulated rig hangs at rest, and a driver cannot reset a rig
    whose signs are concealed.
    """
    arguments = _list_node_arguments(
        "/excitation", reset_first="false", emulated="true", **settings
    )
    excitation = programs.start("excitation_node", *arguments, to_terminal=True)
    try:
        wait_until_done(excitation, programs, LONGEST_PLAY_S)
    except BadInputError as error:
        if excitation.process.poll():
            raise PlanGivenUpError(str(error)) from error
        raise


def _list_node_arguments(namespace: str, **parameters: object) -> list[str]:
    """Return the command line of a node; an empty text is written as YAML writes it."""
    arguments = ["--ros-args", "-r", f"__ns:={namespace}"]
    for name, value in parameters.items():
        arguments += ["-p", f"{name}:={"''" if value == '' else value}"]
    return arguments


def _make_environment() -> dict[str, str]:
    """Return the variables of a ROS graph apart from all others, with plain logs."""
    return {
        "ROS_DOMAIN_ID": str(secrets.choice(DOMAIN_IDS)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{message}",
    }


def _find_free_ports() -> list[int]:
    """Return two UDP ports that are free now, so that the demo meets no other rig."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as first,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as second,
    ):
        for port in (first, second):
            port.bind((LOOPBACK, 0))
        return [first.getsockname()[1], second.getsockname()[1]]


def diagnose(out: Path, quiet: bool) -> None:
    """Run `sysid diagnose` on the recording; raise BadInputError when it fails."""
    files = ["--twin", out / "nominal_twin.yaml", "--out", out / "diagnosis"]
    status = run_sysid(
        [str(word) for word in ("diagnose", out / "recording", *files)]
        + ["--command-topic", APPLIED_TOPIC, *(["--quiet"] if quiet else [])]
    )
    if status:
        raise BadInputError(
            f"sysid diagnose ended with status {status}; what it said stands above"
        )


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
