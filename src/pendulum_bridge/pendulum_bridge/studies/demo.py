"""The whole job with no hardware, over the real graph, from concealing physics in an emulated rig to opening the seal.

The rig is driven, excited and recorded as a real one would be, and the recording diagnosed as a
user would diagnose it. Run as `python -m pendulum_bridge.studies.demo --out out/demo`.
"""

from __future__ import annotations

import argparse
import secrets
import shutil
import socket
import subprocess
import sys
from pathlib import Path

from pendulum_bridge.emulator.comparison import read_verdict, table
from pendulum_bridge.emulator.seal import open_seal
from pendulum_bridge.programs import SCRIPTS, Program, Programs, wait_for, wait_until_done
from pendulum_bridge.wire.udp import Address
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin, save_twin

SYSID = SCRIPTS / "sysid"
APPLIED = (
    "/rig/applied_pwm"  # what was really sent: the driver limits how fast a command may change
)
LOOPBACK = "127.0.0.1"
START_S = 60.0  # a program that takes longer to start will not
PLAYED_S = 150.0  # the plan's minute, and its start
PATIENCE_S = 2.0  # instead of 0.2 s: on a busy machine an emulated rig may stand still for a moment, and no harm is done
OVERRULED_S = 10.0  # after such a moment the rail guard may have to bring the cart back
DOMAINS = range(1, 100)  # higher ones need ports that the system gives to others


def main(arguments: list[str] | None = None) -> int:
    """Run the demo; return 0 when it came to an answer, 1 when it could not (the reason on stderr)."""
    options = _options(arguments)
    return run_command("demo", lambda: _shown(options), "all that it had started has ended")


def _shown(options: argparse.Namespace) -> None:
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    nominal = load_twin(options.twin)
    _make_room(options.out)
    record(options, nominal, seed)
    diagnose(options.out, SYSID)
    print(answer(options.out, nominal))


def record(options: argparse.Namespace, nominal: Twin, seed: int) -> None:
    """Leave in `out` the seal, the recording and the twin that knows nothing of what is concealed."""
    out, effects, view = options.out, options.effects, options.view
    print(
        f"Concealing {effects} effect(s) and wrong parameters in an emulated rig (again: --seed {seed})",
        flush=True,
    )
    file = out / "nominal_twin.yaml"
    save_twin(Twin(f"{nominal.name}_nominal", nominal.rig), file)
    with Programs(out / "logs", _own_graph()) as programs:
        _start_rig(
            programs, file, ("--conceal", seed, "--effects", effects, "--seal", out / "seal.json")
        )
        if view:
            _start_view(programs, file)
        recorder = programs.start(
            "recorder_node",
            *_node("/", out=out / "recording", twin=file, note=f"demo, seed {seed}"),
        )
        wait_for(recorder, "recording to", START_S)
        _excite(
            programs,
            twin_file=file,
            plan=options.plan or "",
            twin="/twin" if view else "",
            listeners=2 + view,
        )
    print(f"Recorded: {out / 'recording'}", flush=True)


def _start_rig(programs: Programs, file: Path, concealing: tuple[object, ...]) -> Program:
    rig, user = (Address(LOOPBACK, port) for port in _free_ports())
    emulator = programs.start(
        "rig_emulator", "--twin", file, "--listen", rig, "--send", user, *concealing
    )
    wait_for(emulator, "listens on", START_S)
    patience = {"rig_timeout_s": PATIENCE_S, "command_timeout_s": PATIENCE_S}
    settings = {"twin": file, "rig_port": rig.port, "listen_port": user.port, **patience}
    driver = programs.start("driver_node", *_node("/rig", **settings))
    wait_for(driver, "drives", START_S)
    return driver


def _start_view(programs: Programs, file: Path) -> None:
    programs.start("twin_node", *_node("/twin", twin=file))
    page = programs.start("view_node", *_node("/", port=0))
    wait_for(page, "serves http", START_S)
    print(page.said.splitlines()[-1], flush=True)


def _excite(programs: Programs, **settings: object) -> None:
    """Play the plan; what it says of its progress goes to the terminal.

    No reset before it: the emulated rig hangs at rest, and a driver cannot reset a rig whose signs
    are concealed.
    """
    patience = {"silence_s": PATIENCE_S, "overruled_s": OVERRULED_S}
    arguments = _node("/excitation", reset_first="false", **patience, **settings)
    wait_until_done(programs.start("excitation_node", *arguments, heard=True), programs, PLAYED_S)


def _node(namespace: str, **parameters: object) -> list[str]:
    """Return the arguments of a node; empty text is given as YAML has it."""
    given = [
        word
        for name, value in parameters.items()
        for word in ("-p", f"{name}:={value if value != '' else "''"}")
    ]
    return ["--ros-args", "-r", f"__ns:={namespace}", *given]


def _own_graph() -> dict[str, str]:
    """Return an environment in which nobody else's nodes are met, and logs are plain."""
    return {
        "ROS_DOMAIN_ID": str(secrets.choice(DOMAINS)),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "RCUTILS_CONSOLE_OUTPUT_FORMAT": "{message}",
    }


def _free_ports() -> list[int]:
    """Return two ports that are free now, so that no other rig is met."""
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as one,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as two,
    ):
        for each in (one, two):
            each.bind((LOOPBACK, 0))
        return [one.getsockname()[1], two.getsockname()[1]]


def diagnose(out: Path, sysid: Path) -> None:
    """Run `sysid diagnose` on the recording, as a user would, its progress on stderr; raise BadInputError when it fails."""
    twin, to = ("--twin", out / "nominal_twin.yaml"), ("--out", out / "diagnosis")
    command = [sysid, "diagnose", out / "recording", *twin, *to, "--command-topic", APPLIED]
    try:
        done = subprocess.run([str(part) for part in command], check=False)
    except OSError as error:
        raise BadInputError(
            f"expected the diagnosis as {sysid}, but it cannot be run: {error.strerror}"
        ) from error
    if done.returncode:
        raise BadInputError(
            f"sysid diagnose ended with status {done.returncode}; what it said stands above"
        )


def answer(out: Path, nominal: Twin) -> str:
    """Open the seal and return it beside the verdict, with the path of the report."""
    compared = table(
        open_seal(out / "seal.json"), nominal.rig, read_verdict(out / "diagnosis" / "verdict.json")
    )
    return f"\n{compared}\nReport: {out / 'diagnosis' / 'report.html'}"


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="demo", description=" ".join((__doc__ or "").split("\n\n")[0].split())
    )
    parser.add_argument(
        "--out", type=Path, required=True, help="folder for recording, seal and diagnosis"
    )
    parser.add_argument(
        "--seed", type=make_whole_reader(), help="what is concealed; by default another every time"
    )
    parser.add_argument(
        "--effects",
        type=make_whole_reader(),
        default=1,
        help="how many effects are concealed (default 1)",
    )
    parser.add_argument(
        "--twin", type=Path, default=Path("config/inteco.yaml"), help="the rig's nominal constants"
    )
    parser.add_argument("--plan", type=Path, help="a plan file; by default the standard minute")
    parser.add_argument(
        "--view", action="store_true", help="serve the page that shows rig and twin live"
    )
    return parser.parse_args(arguments)


def _make_room(out: Path) -> None:
    """Empty `out` of an earlier demo; raise BadInputError when something else is there."""
    if out.is_dir() and any(out.iterdir()):
        if not (out / "nominal_twin.yaml").is_file():
            raise BadInputError(
                f"--out: expected an empty folder or an earlier demo's, found other files in {out}"
            )
        for folder in ("recording", "diagnosis", "logs"):
            shutil.rmtree(out / folder, ignore_errors=True)
        (out / "seal.json").unlink(missing_ok=True)
    elif out.exists() and not out.is_dir():
        raise BadInputError(f"--out: expected a folder, found the file {out}")


if __name__ == "__main__":
    sys.exit(main())
