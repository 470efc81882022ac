"""The thesis's table 7 on concealed rigs: does a policy that was trained in a twin work on the rig?

Every rig is drawn with physics concealed and wrong constants in its nominal twin. A minute of
excitation is recorded and diagnosed. Then policies are trained in the nominal and in the
identified twin, and a classical controller is designed from the identified twin; all are tried on
the rig (MuJoCo, stepped directly), with no training step there. Where the identified twin's policy
falls short, it is trained on the rig for a little longer. On some rigs a policy is also learned
from nothing. Run as `python -m pendulum_rl_env.studies.transfer --rigs 10 --seed S --out DIR`; a second
run goes on from what is there.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.control.design import design_controller, run_controller
from pendulum_rl_env.scoring import describe_reward
from pendulum_rl_env.studies import stages
from pendulum_rl_env.studies.identify_and_control import run_on_rig
from pendulum_rl_env.studies.on_concealed import fine_tune, learn_from_scratch
from pendulum_rl_env.studies.stages import ConcealedRig, Diagnosis
from pendulum_rl_env.studies.transfer_report import format_table, plot_rewards
from pendulum_rl_env.task import Task
from pendulum_twin.command_line import run_command
from pendulum_twin.files import write_atomically
from pendulum_twin.model import load_twin

SCHEMA = "pendulum_transfer/1"
THESIS_REWARD = 423.0  # what the thesis reached on its rig, after 130,000 steps there
KINDS = "single:5,pair:4,triple:1"
FINE_STEPS = 10_000

Row = dict[str, Any]


def main(arguments: list[str] | None = None) -> int:
    """Run the study; return 0 when it is done, 1 when it could not (the reason on stderr)."""
    options = _parse_options(arguments)
    goes_on = f"the same command goes on from what is in {options.out}"
    return run_command("transfer", lambda: _study(options), goes_on)


def _study(options: argparse.Namespace) -> None:
    load_twin(options.twin)
    with ThreadPoolExecutor(options.processes) as pool:
        rigs = list(pool.map(lambda number: study_rig(number, options), range(options.rigs)))
    told = {
        "schema": SCHEMA,
        "seed": options.seed,
        "preset": options.preset,
        "mark": THESIS_REWARD,
        "rigs": rigs,
    }
    write_atomically(options.out / "transfer.json", json.dumps(told, indent=2) + "\n")
    text = format_table(told)
    write_atomically(options.out / "transfer.md", text + "\n")
    plot_rewards(told, options.out / "transfer.png")
    print(text)


def study_rig(number: int, options: argparse.Namespace) -> Row:
    """Return one rig's row; what its file has already is not done again."""
    file = options.out / f"rig_{number:02d}.json"
    row: Row = (
        json.loads(file.read_text(encoding="utf-8"))
        if file.exists()
        else {"number": number, "rewards": {}}
    )
    rig = stages.conceal(options.out / "rigs", number, options.seed, options.kinds, options.twin)
    found = stages.diagnose(rig, rig.folder / "found")
    row.update(outcome=found.verdict["outcome"], named=found.names, **_open_seal(rig))
    for name, earn in _list_controllers(number, rig, found, options).items():
        if name not in row["rewards"]:
            row["rewards"][name] = rewards = earn()
            write_atomically(file, json.dumps(row, indent=2) + "\n")
            mean = float(np.mean(rewards))
            print(
                f"rig {number}: {name}: {mean:.0f}, {describe_reward(mean)}",
                file=sys.stderr,
                flush=True,
            )
    return row


def _list_controllers(
    number: int, rig: ConcealedRig, found: Diagnosis, options: argparse.Namespace
) -> Mapping[str, Callable[[], list[float]]]:
    """Return by name what gives the rewards of each controller on the rig, in the order in which they are to be made."""
    seeds = range(options.train_seed, options.train_seed + options.train_seeds)
    how = [
        "--preset",
        options.preset,
        *(["--timesteps", str(options.timesteps)] if options.timesteps else []),
    ]
    knowing = [*how, "--verdict", str(found.folder / "verdict.json")]

    def policies(twin: Path, name: str, more: list[str]) -> list[Path]:
        return [
            stages.train_until_good(twin, rig.folder / f"{name}_{seed}", seed, more)
            for seed in seeds
        ]

    def tuned() -> list[float]:
        earned = []
        for policy in policies(found.twin, "identified", knowing):
            before = run_on_rig(rig, policy).reward
            earned.append(
                before
                if before > THESIS_REWARD
                else fine_tune(policy, rig, options.fine_steps, policy.parent / "fine")
            )
        return earned

    scratch = {
        "scratch": lambda: [
            learn_from_scratch(rig, s, options.scratch_steps, rig.folder / f"scratch_{s}")
            for s in seeds
        ]
    }
    return {
        "nominal": lambda: [
            run_on_rig(rig, policy).reward for policy in policies(rig.nominal, "nominal", how)
        ],
        "identified": lambda: [
            run_on_rig(rig, policy).reward
            for policy in policies(found.twin, "identified", knowing)
        ],
        "fine_tuned": tuned,
        "classical": lambda: [run_classical_on_rig(rig, found.twin)],
        **(scratch if number < options.scratch_rigs else {}),
    }


def run_classical_on_rig(rig: ConcealedRig, twin: Path) -> float:
    """Return what the classical controller that is designed from a twin earns in an episode on the rig."""
    task = Task()
    controller = design_controller(load_twin(twin), task)
    env = rig.env(task)
    try:
        return run_controller(env.transport, controller, task)
    finally:
        env.close()


def _open_seal(rig: ConcealedRig) -> Row:
    """Open the seal, now that all is done: what was concealed, for the table."""
    sealed = json.loads((rig.folder / "seal.json").read_text(encoding="utf-8"))
    return {"concealed": sealed.get("effects", sealed)}


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="transfer", description=" ".join((__doc__ or "").split("\n\n")[0].split())
    )
    add = parser.add_argument
    add("--rigs", type=int, default=10, metavar="N", help="how many concealed rigs (10)")
    add("--seed", type=int, required=True, help="what they are drawn from")
    add(
        "--out",
        type=Path,
        required=True,
        help="folder for everything; a second run goes on from what is there",
    )
    add(
        "--kinds",
        default=KINDS,
        metavar="KIND:SHARE,...",
        help=f"how many effects are concealed ({KINDS})",
    )
    add(
        "--twin",
        type=Path,
        default=Path("config/inteco.yaml"),
        help="the nominal rig (config/inteco.yaml)",
    )
    add("--preset", default="fast", help="how policies are trained (fast)")
    add("--timesteps", type=int, help="of each training (the preset's)")
    add("--train-seed", type=int, default=0, help="of the first training on a twin (0)")
    add(
        "--train-seeds",
        type=int,
        default=1,
        metavar="N",
        help="trainings a twin, with seeds counting up (1)",
    )
    add(
        "--fine-steps",
        type=int,
        default=FINE_STEPS,
        help=f"training steps on the rig where a policy falls short ({FINE_STEPS})",
    )
    add(
        "--scratch-rigs",
        type=int,
        default=0,
        metavar="N",
        help="also learn from nothing on the first N rigs (0): minutes each",
    )
    add(
        "--scratch-steps",
        type=int,
        default=50_000,
        help="steps on the rig, at most, when learning from nothing (50000)",
    )
    add("--processes", type=int, default=2, metavar="P", help="rigs at a time (2)")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
