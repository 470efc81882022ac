"""The largest reward that the task pays on a twin, by trajectory optimisation on its own kernel.

The optimal commands are replayed through the environment, which pays the reward that is reported.
`evaluate --optimum FILE.json` then gives rewards as a share of it.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_rl_env.control.classical import Plant, make_plant
from pendulum_rl_env.control.optimum import UPRIGHT_RAD, Optimum, find_optimum
from pendulum_rl_env.env import PendulumEnv
from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.optimum_file import SCHEMA
from pendulum_rl_env.scoring import Episode
from pendulum_rl_env.task import Task
from pendulum_rl_env.video import check_video_path, save_video
from pendulum_twin.arrays import Floats
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.files import write_atomically
from pendulum_twin.model import Twin
from pendulum_twin.parser import Parser, add_common_options, complete

RUN = "python -m pendulum_rl_env.studies.optimum"


def main(arguments: list[str] | None = None) -> int:
    """Run the search; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command("optimum", lambda: _search(options), "nothing was written")


def _search(options: argparse.Namespace) -> None:
    if options.video is not None:
        check_video_path(options.video)
    started_s = time.monotonic()
    twin = load_learnable_twin(options.twin)
    task = Task.make_for_step(options.step_s).allow_commands(twin.rig)
    plant = make_plant(twin, task)
    optimum = find_optimum(plant, options.starts, (lambda _: None) if options.quiet else _say)
    episode = replay_commands(plant.twin, optimum.run.commands, task)
    facts = describe_optimum(plant, optimum, episode)
    facts["elapsed_s"] = round(time.monotonic() - started_s, 1)
    if options.out is not None:
        write_atomically(options.out, json.dumps(facts, indent=2) + "\n")
    if options.video is not None:
        save_video(episode, task, options.video)
    print(format_optimum(facts))


def replay_commands(twin: Twin, commands: Floats, task: Task) -> Episode:
    """Return the episode that commands give in the environment, from hanging at rest."""
    env = PendulumEnv(KernelTransport(twin, task.step_s), task)
    _, info = env.reset()
    states, applied, total, end = [info["state"]], [], 0.0, "none"
    for command in commands:
        _, reward, terminated, _, info = env.step(np.array([command]))
        total += reward
        states.append(info["state"])
        applied.append(info["applied_pwm"])
        end = info["end"]
        if terminated:
            break
    env.close()
    return Episode(total, len(applied), end, np.array(states), np.array(applied))


def describe_optimum(plant: Plant, optimum: Optimum, episode: Episode) -> dict[str, Any]:
    """Return what the file of an optimum holds; see `docs/formats.md`."""
    lean = np.abs(np.remainder(episode.states[:, 1] + np.pi, 2 * np.pi) - np.pi)
    leaning = np.flatnonzero(lean > UPRIGHT_RAD)
    return {
        "schema": SCHEMA,
        "twin": plant.twin.name,
        "step_s": plant.task.step_s,
        "steps": plant.task.steps,
        "reward": episode.reward,
        "end": episode.end,
        "upright_after_s": float((leaning[-1] + 1) * plant.task.step_s) if len(leaning) else 0.0,
        "largest_place_m": float(np.abs(episode.states[:, 0]).max()),
        "largest_pwm": float(np.abs(episode.commands).max()),
        "starts": list(optimum.starts),
        "ends": list(optimum.ends),
        "agreeing": optimum.agreeing,
        "commands": episode.commands.tolist(),
        "states": episode.states.tolist(),
    }


def format_optimum(facts: dict[str, Any]) -> str:
    """Return an optimum as lines for a person."""
    ends = ", ".join(f"{end:.1f}" for end in facts["ends"])
    return (
        f"{facts['twin']}: the environment pays {facts['reward']:.2f} of {facts['steps']} for the "
        f"best commands found ({facts['elapsed_s']:.0f} s)\n"
        f"  upright for good after {facts['upright_after_s']:.2f} s; at most "
        f"{facts['largest_place_m']:.2f} m from the middle, PWM up to "
        f"{facts['largest_pwm']:.2f}\n"
        f"  {facts['agreeing']} of {len(facts['ends'])} starts end there: {ends}"
    )


def _say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="optimum",
        description=__doc__,
        examples=(
            f"{RUN} --twin config/inteco.yaml --out out/optimum.json",
            f"{RUN} --starts 8 --video out/optimum.gif",
        ),
    )
    add_common_options(parser)
    add = parser.add_argument
    add("--twin", type=Path, help="twin file (default: the INTECO rig)")
    add(
        "--out",
        type=Path,
        metavar="FILE.json",
        help="where the plan is written (default: nowhere)",
    )
    starts = "how many different swing-ups are improved"
    add("--starts", type=make_whole_reader(1), default=4, metavar="N", help=starts)
    add("--step-s", type=float, default=0.03, metavar="S", help="from command to command")
    add("--video", type=Path, metavar="FILE.mp4|FILE.gif", help="also write the episode as video")
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
