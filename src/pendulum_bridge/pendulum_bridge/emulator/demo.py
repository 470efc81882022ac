"""The whole job with no hardware: conceal physics in an emulated rig, record it, diagnose the recording, open the seal.

Run as `python -m pendulum_bridge.emulator.demo --out out/demo`.
"""

from __future__ import annotations

import argparse
import secrets
import shutil
import subprocess
import sys
from pathlib import Path

from pendulum_bridge.bag_writer import write_bag
from pendulum_bridge.emulator.comparison import read_verdict, table
from pendulum_bridge.emulator.conceal import draw
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_bridge.emulator.seal import open_seal, write_seal
from pendulum_bridge.emulator.session import play
from pendulum_bridge.excitation import standard
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin, save_twin

SYSID = Path(sys.executable).parent / "sysid"


def main(arguments: list[str] | None = None) -> int:
    """Run the demo; return 0 when it came to an answer, 1 when it could not (the reason on stderr)."""
    options = _options(arguments)
    seed = secrets.randbelow(10**6) if options.seed is None else options.seed
    try:
        nominal = load_twin(options.twin)
        _make_room(options.out)
        record(options.out, nominal, seed, options.effects)
        diagnose(options.out, SYSID)
        print(answer(options.out, nominal))
    except BadInputError as error:
        print(f"demo: {error}", file=sys.stderr)
        return 1
    return 0


def record(out: Path, nominal: Twin, seed: int, effects: int) -> None:
    """Conceal effects by a seed and leave in `out` the seal, the recording and the twin that knows nothing of them."""
    print(f"Concealing {effects} effect(s) and wrong parameters in an emulated rig (again: --seed {seed})", flush=True)
    concealed = draw(seed, effects, nominal.rig)
    write_seal(concealed, out / "seal.json")
    save_twin(Twin(f"{nominal.name}_nominal", nominal.rig), out / "nominal_twin.yaml")
    plan = standard(seed=seed)
    write_bag(play(EmulatedRig(concealed, plan.rate_hz), plan), out / "recording")
    print(f"Recorded {len(plan.commands) / plan.rate_hz:g} s: {out / 'recording'}", flush=True)


def diagnose(out: Path, sysid: Path) -> None:
    """Run `sysid diagnose` on the recording, as a user would, its progress on stderr; raise BadInputError when it fails."""
    command = [sysid, "diagnose", out / "recording", "--twin", out / "nominal_twin.yaml", "--out", out / "diagnosis"]
    try:
        done = subprocess.run([str(part) for part in command], check=False)
    except OSError as error:
        raise BadInputError(f"expected the diagnosis as {sysid}, but it cannot be run: {error.strerror}") from error
    if done.returncode:
        raise BadInputError(f"sysid diagnose ended with status {done.returncode}; what it said stands above")


def answer(out: Path, nominal: Twin) -> str:
    """Open the seal and return it beside the verdict, with the path of the report."""
    compared = table(open_seal(out / "seal.json"), nominal.rig, read_verdict(out / "diagnosis" / "verdict.json"))
    return f"\n{compared}\nReport: {out / 'diagnosis' / 'report.html'}"


def _options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="demo", description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--out", type=Path, required=True, help="folder for recording, seal and diagnosis")
    parser.add_argument("--seed", type=int, help="what is concealed; by default another every time")
    parser.add_argument("--effects", type=int, default=1, help="how many effects are concealed (default 1)")
    parser.add_argument("--twin", type=Path, default=Path("config/inteco.yaml"), help="the rig's nominal constants")
    return parser.parse_args(arguments)


def _make_room(out: Path) -> None:
    """Empty `out` of an earlier demo; raise BadInputError when something else is there."""
    if out.is_dir() and any(out.iterdir()):
        if not (out / "seal.json").is_file():
            raise BadInputError(f"--out: expected an empty folder or an earlier demo's, found other files in {out}")
        for folder in ("recording", "diagnosis"):
            shutil.rmtree(out / folder, ignore_errors=True)
    elif out.exists() and not out.is_dir():
        raise BadInputError(f"--out: expected a folder, found the file {out}")


if __name__ == "__main__":
    sys.exit(main())
