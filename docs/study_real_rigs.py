"""Diagnose the real rigs in parts, and run every part's twin on the parts that it has not seen.

Laws that two parts have measured apart are compared. Writes bags and verdicts, and prints the
tables of docs/real_rigs.md.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path

from cut_recording import cut
from law_agreement import format_agreements, list_agreements
from program_options import parse_study_of_rigs

import pendulum_sysid as ps
from pendulum_sysid.cli import main as sysid
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.prepare import prepare
from pendulum_twin.command_line import run_command
from pendulum_twin.model import load_twin
from pendulum_twin.parameter_vector import make_theta

QUANSER = "--time t --command u_applied --cart x --pole theta --pole-zero down"
EMPS = "--time t --command vir --cart qm"
FREE_SWING = "--time t --pole theta"
SENSORSINI = "--time time --command Q --cart position --pole angle"


@dataclass(frozen=True)
class Rig:
    """Hold a rig's twin as its users believe it, and its recordings in parts.

    parts: name -> bags that are diagnosed together.
    judges: name -> bags that no diagnosis is made of.
    apart: groups of names of parts that share no time.
    """

    twin: Path
    parts: dict[str, list[Path]]
    judges: dict[str, list[Path]]
    apart: tuple[tuple[str, ...], ...]


def import_files(files: list[Path], columns: str, out: Path) -> list[Path]:
    """Return a bag a file, in the order of the files."""
    bags = [out / file.stem for file in files]
    for file, bag in zip(files, bags, strict=True):
        if not bag.exists():
            with redirect_stdout(sys.stderr):
                sysid(["--quiet", "import", str(file), "--out", str(bag), *columns.split()])
    return bags


def cut_parts(bag: Path, count: int, out: Path) -> dict[str, list[Path]]:
    """Return equal stretches of a recording."""
    seconds = len(ps.read_recording(bag).signals) * ps.read_recording(bag).signals.period_s
    parts = {}
    for k in range(count):
        part = out / f"{bag.name}_{k + 1}_of_{count}"
        if not part.exists():
            cut(str(bag), str(part), seconds * k / count, seconds * (k + 1) / count)
        parts[f"{k + 1} of {count}"] = [part]
    return parts


def open_inteco(rigs: Path, out: Path) -> Rig:
    """Return the thesis's rig: halves and thirds of a minute of a sweep."""
    bag = rigs / "inteco_rig" / "open_loop_0_60s"
    twin = rigs / "inteco_rig" / "twin.yaml"
    halves, thirds = cut_parts(bag, 2, out), cut_parts(bag, 3, out)
    return Rig(twin, {"whole": [bag], **halves, **thirds}, {}, (tuple(halves), tuple(thirds)))


def open_quanser(rigs: Path, out: Path) -> Rig:
    """Return the chirps, all and in two groups; swing-ups judge."""
    folder = rigs / "quanser_cartpole"
    chirps = import_files(sorted((folder / "chirp").glob("*.csv")), QUANSER, out / "chirps")
    swings = sorted((folder / "swing_up").glob("*.csv"))
    judges = import_files(swings, QUANSER + " --skip 0.54", out / "swing_ups")
    parts = {"all chirps": chirps, "chirps 1, 2": chirps[:2], "chirps 3 to 5": chirps[2:]}
    apart = ("chirps 1, 2", "chirps 3 to 5")
    return Rig(folder / "twin.yaml", parts, {"swing-ups": judges}, (apart,))


def open_emps(rigs: Path, out: Path) -> Rig:
    """Return the cart alone: halves of its recording."""
    (bag,) = import_files([rigs / "emps" / "emps_estimation.csv"], EMPS, out)
    halves = cut_parts(bag, 2, out)
    return Rig(Path("config/emps.yaml"), {"whole": [bag], **halves}, {}, (tuple(halves),))


def open_free_swing(rigs: Path, out: Path) -> Rig:
    """Return the pole alone: halves of its recording."""
    file = rigs / "multiarm_free_swing" / "single_free_swing_id.csv"
    (bag,) = import_files([file], FREE_SWING, out)
    halves = cut_parts(bag, 2, out)
    return Rig(Path("config/free_swing.yaml"), {"whole": [bag], **halves}, {}, (tuple(halves),))


def open_sensorsini(rigs: Path, out: Path) -> Rig:
    """Return the rig in closed loop: odd and even of 24 recordings, and the first half.

    The last twelve judge, and the second half.
    """
    folder = rigs / "sensorsini_cartpole"
    files = sorted(folder.glob("v1/*.csv"), key=lambda file: int(file.stem.split("-")[1]))
    bags = import_files(files, SENSORSINI, out / "sensorsini")
    apart = {"odd of 24": bags[0:24:2], "even of 24": bags[1:24:2]}
    parts = {**apart, "first 30": bags[:30]}
    judges = {"last 12": bags[48:], "last 30": bags[30:]}
    return Rig(folder / "twin.yaml", parts, judges, (tuple(apart),))


RIGS = {
    "inteco": open_inteco,
    "quanser": open_quanser,
    "emps": open_emps,
    "free_swing": open_free_swing,
    "sensorsini": open_sensorsini,
}


def study(name: str, rig: Rig, out: Path) -> None:
    """Print the verdicts of a rig's parts, and the errors of their twins on every part."""
    print(f"\n### {name}\n\n| part | outcome | names, 95 % intervals | laws | work, s |")
    print("|---|---|---|---|---|", flush=True)
    twins: dict[str, str | Path | ps.Twin] = {"given": rig.twin}
    verdicts: dict[str, ps.Verdict] = {}
    for part, bags in rig.parts.items():
        began = time.process_time()
        verdict = ps.diagnose([str(bag) for bag in bags], rig.twin)
        work = time.process_time() - began
        file = out / f"{name}_{part.replace(' ', '_').replace(',', '')}.json"
        file.write_text(json.dumps(verdict.to_dict(), indent=1), encoding="utf-8")
        verdicts[part] = verdict
        if verdict.twin is not None:
            twins[part] = verdict.twin
        laws = ", ".join(f"`{law.law}`" for law in verdict.measured_laws) or "-"
        print(
            f"| {part} | `{verdict.outcome.value}` | {describe(verdict)} | {laws} | {work:.0f} |"
        )
        sys.stdout.flush()
    heads = ["given twin" if twin == "given" else f"twin of {twin}" for twin in twins]
    print(f"\n| errors over 1 s on | {' | '.join(heads)} |")
    print("|---" * (len(twins) + 1) + "|")
    for part, bags in {**rig.parts, **rig.judges}.items():
        paths = [str(bag) for bag in bags]
        cells = [measure(paths, twin) for twin in twins.values()]
        if part in rig.judges:
            floors = [f" ({measure_floors(paths, twin):.2g} floors)" for twin in twins.values()]
            cells = [cell + floor for cell, floor in zip(cells, floors, strict=True)]
        print(f"| {part} | {' | '.join(cells)} |", flush=True)
    agreements = [each for group in rig.apart for each in list_agreements(verdicts, group)]
    print(f"\n{format_agreements(agreements)}", flush=True)


def describe(verdict: ps.Verdict) -> str:
    """Return every name with its sizes, and the names that it cannot be told from."""
    texts = []
    for missing in verdict.missing_physics:
        sizes = ", ".join(
            f"{key} {size.value:.3g} [{size.low:.3g}, {size.high:.3g}]"
            for key, size in missing.parameters.items()
        )
        ties = ", ".join(f"`{tie}`" for tie in missing.cannot_be_told_from)
        texts.append(f"`{missing.effect}` {sizes}{f' (or {ties})' if ties else ''}".strip())
    return "; ".join(texts) or "-"


def measure(bags: list[str], twin: str | Path | ps.Twin) -> str:
    """Return the errors of free runs of 1 s: cart in mm, pole in mrad."""
    errors = ps.replay(bags, twin)
    pairs = ((errors.cart_rmse_m, "mm"), (errors.pole_rmse_rad, "mrad"))
    return ", ".join(f"{1e3 * error:.3g} {unit}" for error, unit in pairs if error is not None)


def measure_floors(bags: list[str], twin: str | Path | ps.Twin) -> float:
    """Return the error of free runs of 1 s, in what a perfect twin reaches; NaN if unknown."""
    recordings = [ps.read_recording(bag) for bag in bags]
    case = prepare(recordings, load_twin(twin) if isinstance(twin, str | Path) else twin).case
    windows = cut_windows(case.signals, case.state, WINDOW_S)
    floor = measure_noise_floor(case, make_theta(case.twin), windows)
    return run_windows(case, windows).score / floor.score if floor else math.nan


def main(arguments: Sequence[str] | None = None) -> int:
    """Study the rigs that are named, or all; return the exit status."""
    given = parse_study_of_rigs("study_real_rigs", __doc__, RIGS, arguments)

    def study_each() -> None:
        given.out.mkdir(parents=True, exist_ok=True)
        for name in given.names:
            study(name, RIGS[name](given.rigs, given.out), given.out)

    return run_command("study_real_rigs", study_each, f"{given.out} holds what was made")


if __name__ == "__main__":
    sys.exit(main())
