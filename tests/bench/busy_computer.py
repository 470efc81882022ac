"""What demos and `identify.launch.xml` come to on a computer that is busy.

Each emulated rig conceals one effect. It is recorded beside programs that compute without end, and
the diagnosis is compared with the open seal. Run as
`python tests/bench/busy_computer.py --demos 10 --launches 10 --seed 101`; the table is Markdown.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TESTS = Path(__file__).parents[1]
sys.path[:0] = [str(TESTS)]

from support.launch_files import read  # noqa: E402
from support.launch_running import running  # noqa: E402
from support.polling import until  # noqa: E402
from support.running_emulator import TWIN, free_ports  # noqa: E402

from pendulum_bridge.emulator.seal import open_seal  # noqa: E402
from pendulum_bridge.studies.comparison import format_comparison, read_verdict  # noqa: E402
from pendulum_bridge.studies.emulated_graph import APPLIED_TOPIC, make_environment  # noqa: E402
from pendulum_twin.model import Twin, load_twin, save_twin  # noqa: E402

WORK = "while True: pass"
LONGEST_S = 900.0
ANSWERS = ("The diagnosis ", "The names are")


def main() -> None:
    options = parse_options()
    out = options.out or Path(tempfile.mkdtemp(prefix="busy_computer_"))
    print(f"Recordings and verdicts: {out}\n")
    print("| program | seed | concealed | s | load | what the open seal says | remains |")
    print("|---|---|---|---|---|---|---|", flush=True)
    runs = [("make demo", run_demo)] * options.demos
    runs += [("identify", run_launch)] * options.launches
    with busy(options.busy):
        for k, (name, run) in enumerate(runs):
            seed, begun = options.seed + k, time.monotonic()
            folder = out / f"{seed}"
            answer = run(folder, seed)
            seconds, load = time.monotonic() - begun, os.getloadavg()[0]
            concealed, remains = describe_folder(folder)
            row = f"{name} | {seed} | {concealed} | {seconds:.0f} | {load:.1f} | {answer}"
            print(f"| {row} | {remains} |", flush=True)


@contextmanager
def busy(count: int) -> Iterator[None]:
    """Compute without end in so many processes."""
    programs = [subprocess.Popen([sys.executable, "-c", WORK]) for _ in range(count)]
    try:
        yield
    finally:
        for program in programs:
            program.kill()
            program.wait()


def run_demo(folder: Path, seed: int) -> str:
    """Run a demo, and return what it says when the seal is open, or how it ended."""
    words = ["-m", "pendulum_bridge.studies.demo", "--out", folder, "--seed", seed, "--quiet"]
    done = subprocess.run(
        [sys.executable, *map(str, words)], capture_output=True, text=True, timeout=LONGEST_S
    )
    if done.returncode:
        return f"status {done.returncode}: {find_last_line(done.stderr)}"
    return find_answer(done.stdout)


def run_launch(folder: Path, seed: int) -> str:
    """Record with the programs of the launch file, diagnose, and return what the seal says."""
    folder.mkdir(parents=True)
    given = load_twin(TWIN)
    save_twin(Twin(given.name, given.rig), folder / "nominal_twin.yaml")
    rig, user = free_ports()
    launch = read(
        "identify", twin=folder / "nominal_twin.yaml", out=folder / "recording",
        pendulum="emulated", rig_port=rig, listen_port=user, conceal=seed,
        seal=folder / "seal.json",
    )  # fmt: skip
    with running(launch, {**os.environ, **make_environment()}, folder / "logs") as programs:
        until(programs.over, "the end of the plan", deadline_s=LONGEST_S)
        first = programs.over()
        failed = {name: status for name, status in programs.end().items() if status}
    if failed:
        return f"{first} ended first, with status {failed}"
    words = ["diagnose", folder / "recording", "--twin", folder / "nominal_twin.yaml"]
    words += ["--out", folder / "diagnosis", "--command-topic", APPLIED_TOPIC, "--quiet"]
    program = [sys.executable, "-m", "pendulum_sysid.cli", *map(str, words)]
    done = subprocess.run(program, capture_output=True, text=True, timeout=LONGEST_S)
    if done.returncode:
        return f"sysid ended with status {done.returncode}: {find_last_line(done.stderr)}"
    verdict = read_verdict(folder / "diagnosis" / "verdict.json")
    concealed = open_seal(folder / "seal.json")
    return find_answer(format_comparison(concealed, given.rig, verdict))


def find_last_line(text: str) -> str:
    """Return the last line of what a program has said, for a cell of the table."""
    lines = text.strip().splitlines()
    return lines[-1].replace("|", "/") if lines else "no word"


def find_answer(text: str) -> str:
    """Return the last sentence of a comparison with the seal."""
    said = [line for line in text.splitlines() if line.startswith(ANSWERS)]
    return said[-1].rstrip(".") if said else "no answer"


def describe_folder(folder: Path) -> tuple[str, str]:
    """Return what the seal held, and the errors that remain, in noise floors."""
    seal, file = folder / "seal.json", folder / "diagnosis" / "verdict.json"
    concealed = ", ".join(open_seal(seal).effects) if seal.exists() else "-"
    if not file.exists():
        return concealed, "-"
    rest = read_verdict(file)["remainder"]
    return concealed, f"{rest['above_noise_floor']:.1f}" if rest else "at the noise"


def parse_options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--demos", type=int, default=10)
    parser.add_argument("--launches", type=int, default=10)
    parser.add_argument("--seed", type=int, default=101, help="of the first; the next count on")
    parser.add_argument("--busy", type=int, default=8, help="programs that compute beside")
    parser.add_argument("--out", type=Path, help="folder; by default a new temporary folder")
    return parser.parse_args()


if __name__ == "__main__":
    main()
