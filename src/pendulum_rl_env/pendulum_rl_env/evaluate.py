"""Evaluate a policy: episodes from hanging at rest, in the twin or on a rig over topics, without exploration."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym

from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.algorithms import load_policy, make_policy
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS
from pendulum_rl_env.posterior import gather_knowledge
from pendulum_rl_env.scoring import run_episode, summarise
from pendulum_rl_env.task import Task
from pendulum_rl_env.video import save_video
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.errors import BadInputError


def main(arguments: list[str] | None = None) -> int:
    """Run `evaluate`; return 0 when it is done, 1 when it could not (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command("evaluate", lambda: print(_evaluate(options)), "the drive is at PWM 0")


def _evaluate(options: argparse.Namespace) -> str:
    policy = make_policy(load_policy(options.policy))
    env = _make_environment(options)
    try:
        if env.observation_space.shape != (5,):
            raise BadInputError(
                f"{options.policy}: expected a policy of {IN_PROCESS}, found another task's"
            )
        episodes = [run_episode(env, policy, options.seed + k) for k in range(options.episodes)]
    except ValueError as error:  # a policy of another task
        raise BadInputError(
            f"{options.policy}: expected a policy for observations (5,): {error}"
        ) from error
    finally:
        env.close()
    if options.video is not None:
        save_video(episodes[0], env.unwrapped.task, options.video)  # type: ignore[attr-defined]
    told = summarise(episodes)
    return json.dumps(told, indent=2) if options.json else format_summary(told)


def format_summary(told: dict[str, Any]) -> str:
    """Return a summary as lines for a person."""
    mean, least = told["mean_reward"], told["min_reward"]
    lines = [
        f"{told['episodes']} episodes: mean reward {mean:.1f}, minimum {least:.1f}: {told['words']}"
    ]
    for each in told["slices"]:
        low = "below" if each["from"] is None else f"{each['from']:g} to"
        high = "more" if each["to"] is None else f"{each['to']:g}"
        lines.append(f"  {low:>7} {high:<5} {each['episodes']:>4}  {each['means']}")
    return "\n".join(lines)


def _make_environment(options: argparse.Namespace) -> gym.Env[Any, Any]:
    render = "rgb_array" if options.video is not None else None
    steps = Task.make_for_step(options.step_s).steps
    if options.rig is not None:
        return gym.make(
            OVER_TOPICS,
            namespace=options.rig,
            step_s=options.step_s,
            render_mode=render,
            max_episode_steps=steps,
        )
    known = gather_knowledge(load_learnable_twin(options.twin), options.verdict, 0, options.seed)
    return gym.make(
        IN_PROCESS,
        twin=known.twins[0],
        encoders=known.encoders,
        step_s=options.step_s,
        render_mode=render,
        max_episode_steps=steps,
    )


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="evaluate", description=" ".join((__doc__ or "").split())
    )
    add = parser.add_argument
    add(
        "--policy", type=Path, required=True, metavar="POLICY.zip", help="what `train` has written"
    )
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--twin", type=Path, help="twin file")
    where.add_argument(
        "--rig", metavar="NAMESPACE", help="the rig of this namespace, over topics, in real time"
    )
    add("--verdict", type=Path, help="verdict.json: measure as finely as that recording's rig did")
    add("--episodes", type=make_whole_reader(1), default=20, metavar="N", help="how many (20)")
    add("--seed", type=int, default=0, help="of the first episode (0); a twin alone draws nothing")
    add("--step-s", type=float, default=0.03, metavar="S", help="from command to command (0.03)")
    add(
        "--video",
        type=Path,
        metavar="FILE.gif",
        help="also write the first episode as an animation",
    )
    add("--json", action="store_true", help="print one JSON object")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
