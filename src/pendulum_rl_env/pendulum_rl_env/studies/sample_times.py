"""The thesis's study of sample times (table 3): the same training with several sample times.

An episode lasts 15.36 s with each of them, so rewards are given a step.
"""

from __future__ import annotations

import argparse
import json
import sys
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.studies import stages
from pendulum_rl_env.studies.workers import add_engine_options, run_study
from pendulum_rl_env.task import EPISODE_S, Task
from pendulum_twin.command_line import run_command
from pendulum_twin.files import write_atomically
from pendulum_twin.model import load_twin
from pendulum_twin.parser import Parser, add_common_options, complete

SHORTEST_STEP_S, LONGEST_STEP_S = 0.005, 0.5 * EPISODE_S

RUN = "python -m pendulum_rl_env.studies.sample_times"


def main(arguments: list[str] | None = None) -> int:
    """Run the study; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    resumable = f"the same command goes on from what is in {options.out}"
    return run_command("sample_times", lambda: _study(options), resumable)


def _study(options: argparse.Namespace) -> None:
    load_twin(options.twin)
    seeds = range(options.seed, options.seed + options.seeds)
    options.out, options.twin = options.out.absolute(), options.twin.absolute()
    pairs = list(product(options.step_s, seeds))
    results = run_study(partial(_train, options=options), pairs, options)
    rows = [
        _make_row(
            step_s,
            [result for pair, result in zip(pairs, results, strict=True) if pair[0] == step_s],
        )
        for step_s in options.step_s
    ]
    write_atomically(options.out / "sample_times.json", json.dumps(rows, indent=2) + "\n")
    print(_format_table(rows))


def _train(pair: tuple[float, int], options: argparse.Namespace) -> dict[str, Any]:
    """Return `result.json` of a training with this sample time and seed."""
    step_s, seed = pair
    out = options.out / f"step_{step_s:g}_seed_{seed}"
    how = ["--step-s", str(step_s), "--preset", options.preset]
    if options.timesteps:
        how += ["--timesteps", str(options.timesteps)]
    policy = stages.train_policy(options.twin, out, seed, how)
    result: dict[str, Any] = json.loads((policy.parent / "result.json").read_text("utf-8"))
    return result


def _make_row(step_s: float, results: list[dict[str, Any]]) -> dict[str, Any]:
    """Return the figures of one sample time; a reward a step of 1 is upright in the middle."""
    steps = Task.make_for_step(step_s).steps
    best = [result["best_mean_reward"] / steps for result in results]
    return {
        "step_s": step_s,
        "steps_an_episode": steps,
        "best_reward_a_step": best,
        "median": float(np.median(best)),
        "wall_s": [result["wall_s"] for result in results],
    }


def _format_table(rows: list[dict[str, Any]]) -> str:
    lines = [
        "| sample time, s | steps an episode | best reward a step: median, each seed "
        "| wall time, s: median |",
        "|---|---|---|---|",
    ]
    for row in rows:
        rewards = ", ".join(f"{value:.3f}" for value in row["best_reward_a_step"])
        lines.append(
            f"| {row['step_s']:g} | {row['steps_an_episode']} | {row['median']:.3f} ({rewards}) "
            f"| {np.median(row['wall_s']):.0f} |"
        )
    return "\n".join(lines)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="sample_times",
        description=__doc__,
        examples=(
            f"{RUN} --twin config/inteco.yaml --out out/sample_times",
            f"{RUN} --step-s 0.02 0.03 --seeds 5 --out out/sample_times",
        ),
    )
    add_common_options(parser)
    add, twin = parser.add_argument, Path("config/inteco.yaml")
    add("--twin", type=Path, default=twin, help="twin file")
    out = "folder for the trainings; a second run goes on from what is there"
    add("--out", type=Path, required=True, help=out)
    steps_s = [0.01, 0.02, 0.03, 0.05, 0.1]
    add("--step-s", type=float, nargs="+", default=steps_s, help="sample times, s")
    add("--seed", type=int, default=0, help="of the first training")
    add("--seeds", type=int, default=3, metavar="N", help="trainings a sample time")
    add("--preset", default="fast", help="how to train")
    add("--timesteps", type=int, help="of each training (default: the preset's)")
    add_engine_options(parser, "trainings")
    complete(parser)
    options = parser.parse_args(arguments)
    for step_s in options.step_s:
        if not SHORTEST_STEP_S <= step_s <= LONGEST_STEP_S:
            parser.error(
                f"--step-s: expected sample times from {SHORTEST_STEP_S:g} s to "
                f"{LONGEST_STEP_S:g} s, found {step_s:g}"
            )
    return options


if __name__ == "__main__":
    sys.exit(main())
