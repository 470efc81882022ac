"""The thesis's table 7 on concealed rigs: does a policy trained in a twin work on the rig?

Every rig has physics concealed and wrong constants in its nominal twin. A minute of excitation is
recorded and diagnosed. Policies are trained in the nominal and in the identified twin, and a
classical controller is designed from the identified twin; all run on the rig (MuJoCo, stepped
directly), with no training step there. Where the policy of the identified twin falls short, it is
trained on the rig for a little longer. On some rigs a policy is also learned from nothing. The
preset residual is trained in the identified twin (`residual`) and in the nominal twin with
constants refitted (`refitted`); `real_time` plays it through emulator, driver and topics. A second
run continues from what is there; tables hold the rigs of the run.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.scoring import describe_reward
from pendulum_rl_env.studies import stages
from pendulum_rl_env.studies.stages import ConcealedRig, Diagnosis
from pendulum_rl_env.studies.transfer_controllers import (
    THESIS_REWARD,
    Rewards,
    RigControllers,
)
from pendulum_rl_env.studies.transfer_report import DEFAULT_ROWS, ROWS, format_table, plot_rewards
from pendulum_rl_env.studies.workers import add_engine_options, run_study
from pendulum_twin.command_line import run_command
from pendulum_twin.files import write_atomically
from pendulum_twin.model import load_twin
from pendulum_twin.parser import Parser, add_common_options, complete

SCHEMA = "pendulum_transfer/1"
KINDS = "single:5,pair:4,triple:1"
FINE_STEPS = 10_000

Row = dict[str, Any]

RUN = "python -m pendulum_rl_env.studies.transfer"


def main(arguments: list[str] | None = None) -> int:
    """Run the study; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    resumable = f"the same command goes on from what is in {options.out}"
    return run_command("transfer", lambda: _study(options), resumable)


def _study(options: argparse.Namespace) -> None:
    load_twin(options.twin)
    options.out, options.twin = options.out.absolute(), options.twin.absolute()
    rigs = run_study(
        partial(study_rig, options=options),
        range(options.first, options.first + options.rigs),
        options,
        (lambda number, row: None) if options.quiet else _report_rig,
    )
    study = {
        "schema": SCHEMA,
        "seed": options.seed,
        "preset": options.preset,
        "mark": THESIS_REWARD,
        "rigs": rigs,
    }
    write_atomically(options.out / "transfer.json", json.dumps(study, indent=2) + "\n")
    table = format_table(study)
    write_atomically(options.out / "transfer.md", table + "\n")
    plot_rewards(study, options.out / "transfer.png")
    print(table)


def study_rig(number: int, options: argparse.Namespace) -> Row:
    """Return one rig's row; a reward that its file has already is not measured again."""
    file = options.out / f"rig_{number:02d}.json"
    row: Row = {"number": number, "rewards": {}}
    if file.exists():
        row = json.loads(file.read_text(encoding="utf-8"))
    rig = stages.conceal(options.out / "rigs", number, options.seed, options.kinds, options.twin)
    diagnosis = stages.diagnose(rig, rig.folder / "found")
    row.update(
        outcome=diagnosis.verdict["outcome"], named=diagnosis.names, concealed=_open_seal(rig)
    )
    for name, measure in _list_controllers(number, rig, diagnosis, options).items():
        if name not in row["rewards"]:
            row["rewards"][name] = measure()
            write_atomically(file, json.dumps(row, indent=2) + "\n")
    return row


def _report_rig(number: int, row: Row) -> None:
    """Print a rig's rewards when all of them are measured."""
    for name, rewards in row["rewards"].items():
        mean = float(np.mean(rewards))
        line = f"rig {number}: {name}: {mean:.0f}, {describe_reward(mean)}"
        print(line, file=sys.stderr, flush=True)


def _list_controllers(
    number: int, rig: ConcealedRig, diagnosis: Diagnosis, options: argparse.Namespace
) -> Mapping[str, Rewards]:
    """Return for each controller that is asked for, in order, how its rewards are measured."""
    known = RigControllers(rig, diagnosis, options).list_all()
    scratch = ("scratch",) if number < options.scratch_rigs else ()
    return {name: known[name] for name in known if name in (*options.controllers, *scratch)}


def _open_seal(rig: ConcealedRig) -> Any:
    """Return what was concealed, for the table."""
    sealed = json.loads((rig.folder / "seal.json").read_text(encoding="utf-8"))
    return {**sealed["effects"], **sealed.get("unlisted", {})}


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="transfer",
        description=__doc__,
        examples=(
            f"{RUN} --rigs 10 --seed 11 --out out/transfer",
            f"{RUN} --rigs 1 --first 9 --seed 11 --controllers identified classical --out out/one",
        ),
    )
    add_common_options(parser)
    add = parser.add_argument
    add("--rigs", type=int, default=10, metavar="N", help="how many concealed rigs")
    add("--first", type=int, default=0, metavar="K", help="number of the first rig")
    kinds = f"which are tried (default: {' '.join(DEFAULT_ROWS)})"
    choices = [name for name in ROWS if name != "scratch"]
    add("--controllers", nargs="+", choices=choices, default=DEFAULT_ROWS, help=kinds)
    add("--seed", type=int, required=True, help="what they are drawn from")
    out = "folder for everything; a second run goes on from what is there"
    add("--out", type=Path, required=True, help=out)
    kinds = "how many effects are concealed, with the share of each kind"
    add("--kinds", default=KINDS, metavar="KIND:SHARE,...", help=kinds)
    add("--twin", type=Path, default=Path("config/inteco.yaml"), help="the nominal rig")
    add("--preset", default="fast", help="of nominal, identified and fine_tuned")
    add("--timesteps", type=int, help="of each such training (default: the preset's)")
    add("--train-seed", type=int, default=0, help="of the first training on a twin")
    seeds = "trainings a twin, with seeds counting up"
    add("--train-seeds", type=int, default=1, metavar="N", help=seeds)
    fine = "training steps on the rig where a policy falls short"
    add("--fine-steps", type=int, default=FINE_STEPS, help=fine)
    scratch = "also learn from nothing on the first N rigs: minutes each"
    add("--scratch-rigs", type=int, default=0, metavar="N", help=scratch)
    steps = "steps on the rig, at most, when learning from nothing"
    add("--scratch-steps", type=int, default=50_000, help=steps)
    most = "trainings of a policy, at most, until a policy is good"
    add("--trainings", type=int, default=stages.MOST_TRAININGS, metavar="N", help=most)
    add_engine_options(parser, "rigs")
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
