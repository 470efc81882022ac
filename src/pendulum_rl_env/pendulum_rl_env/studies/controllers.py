"""Controllers beside each other on a twin: classical, predictive, learned, and the optimum.

Each is designed from the twin, and runs on the twin and on twins that are not quite it (drive 5 %,
inertia 3 %, start up to 0.08 rad off hanging), with encoders as coarse as a rig's.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.command_limits import check_limits
from pendulum_rl_env.control.design import (
    PERTURBATIONS,
    Controller,
    design_controller,
    make_perturbed_rig,
    run_controller,
)
from pendulum_rl_env.control.planned import design_planned
from pendulum_rl_env.control.predictive import design_predictive
from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.policies import get_task, load_controller, load_policy
from pendulum_rl_env.optimum_file import read_best_reward
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.command_line import run_command
from pendulum_twin.files import write_atomically
from pendulum_twin.model import Twin
from pendulum_twin.parser import Parser, add_common_options, complete

DESIGNS: dict[str, Callable[[Twin, Task], Controller]] = {
    "classical": design_controller,
    "planned": design_planned,
    "predictive": design_predictive,
}

Row = dict[str, Any]


class _Timed:
    """Measure how long a controller takes for each command."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self.seconds: list[float] = []

    def reset(self) -> None:
        self._controller.reset()

    def __call__(self, measured: Floats) -> float:
        begin_s = time.perf_counter()
        command = self._controller(measured)
        self.seconds.append(time.perf_counter() - begin_s)
        return command


RUN = "python -m pendulum_rl_env.studies.controllers"


def main(arguments: list[str] | None = None) -> int:
    """Run the study; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command("controllers", lambda: _study(options), "nothing was written")


def _study(options: argparse.Namespace) -> None:
    twin = load_learnable_twin(options.twin)
    task = Task().allow_commands(twin.rig)
    makers = {name: DESIGNS[name] for name in options.controllers}
    for number, policy in enumerate(options.policy):
        name = "policy" if len(options.policy) == 1 else f"policy {number}"
        makers[name] = partial(_load_policy, policy)
    best = None if options.optimum is None else read_best_reward(options.optimum, task.steps)
    rows = [_try_controller(name, make, twin, task) for name, make in makers.items()]
    if options.out is not None:
        content = {"twin": twin.name, "optimum": best, "rows": rows}
        write_atomically(options.out, json.dumps(content, indent=2) + "\n")
    print(format_table(rows, best))


def _load_policy(policy: Path, twin: Twin, task: Task) -> Controller:
    """Return a learned policy as a controller; of the twin only the limit of its commands counts.

    Raises BadInputError when the policy's commands have another unit than the twin's.
    """
    trained = get_task(load_policy(policy))
    if trained is not None:
        check_limits(trained.pwm_limit, twin.rig.pwm_limit, twin.name)
    return load_controller(policy, task)


def _try_controller(
    name: str, make: Callable[[Twin, Task], Controller], twin: Twin, task: Task
) -> Row:
    """Return a controller's rewards on all rigs, the twin itself first, and its times."""
    begin_s = time.perf_counter()
    controller = _Timed(make(twin, task))
    design_s = time.perf_counter() - begin_s
    rigs = [make_perturbed_rig(twin, task, *changes) for changes in PERTURBATIONS]
    rewards = [run_controller(rig, controller, task) for rig in rigs]
    millis = 1e3 * np.array(controller.seconds)
    return {
        "controller": name,
        "rewards": rewards,
        "design_s": round(design_s, 1),
        "command_ms": float(np.median(millis)),
        "slow_command_ms": float(np.quantile(millis, 0.99)),
    }


def format_table(rows: list[Row], best: float | None) -> str:
    """Return the study as Markdown.

    best: the optimum of the twin; None leaves its row and the shares out.
    """
    lines = [
        "| controller | on the twin | of the optimum | on 4 twins that are not quite it: mean, "
        "least | design, s | a command, ms: median, 99 % |",
        "|---|---|---|---|---|---|",
    ]
    if best is not None:
        lines.append(f"| optimum | {best:.1f} | 100 % | - | - | - |")
    for row in rows:
        exact, others = row["rewards"][0], row["rewards"][1:]
        share = "-" if best is None else f"{100 * exact / best:.1f} %"
        lines.append(
            f"| {row['controller']} | {exact:.1f} | {share} | {np.mean(others):.1f}, "
            f"{min(others):.1f} | {row['design_s']:.0f} | {row['command_ms']:.2g}, "
            f"{row['slow_command_ms']:.2g} |"
        )
    return "\n".join(lines)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="controllers",
        description=__doc__,
        examples=(
            f"{RUN} --twin config/inteco.yaml --policy out/policy/policy.zip",
            f"{RUN} --controllers classical --out out/controllers.json",
        ),
    )
    add_common_options(parser)
    add = parser.add_argument
    add("--twin", type=Path, help="twin file (default: the INTECO rig)")
    kinds = f"which are designed (default: {' '.join(DESIGNS)})"
    add("--controllers", nargs="*", choices=list(DESIGNS), default=list(DESIGNS), help=kinds)
    policy = "what `train` has written, beside them; may stand several times"
    add("--policy", type=Path, action="append", default=[], metavar="POLICY.zip", help=policy)
    optimum = "what `studies.optimum` has written for this twin: give rewards as a share of it"
    add("--optimum", type=Path, metavar="FILE.json", help=optimum)
    add(
        "--out",
        type=Path,
        metavar="FILE.json",
        help="where the figures are written (default: nowhere)",
    )
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
