"""Evaluate a policy without exploration: episodes from hanging at rest, in the twin or on a rig.

A rig is reached over topics, in real time.
"""

from __future__ import annotations

import argparse
import json
import sys
from typing import Any

import gymnasium as gym

from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.policies import get_task, load_policy, make_policy, prepare_env
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS
from pendulum_rl_env.optimum_file import read_best_reward
from pendulum_rl_env.options import parse_evaluate_options
from pendulum_rl_env.posterior import gather_knowledge
from pendulum_rl_env.scoring import run_episode, summarise
from pendulum_rl_env.task import Task, choose_step_s
from pendulum_rl_env.video import check_video_path, save_video
from pendulum_twin.command_line import run_command
from pendulum_twin.errors import BadInputError


def main(arguments: list[str] | None = None) -> int:
    """Run `evaluate`; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = parse_evaluate_options(arguments)
    left = "nothing was evaluated" if options.rig is None else "the drive is at PWM 0"
    return run_command("evaluate", lambda: print(_evaluate(options)), left)


def _evaluate(options: argparse.Namespace) -> str:
    if options.video is not None:
        check_video_path(options.video)
    model = load_policy(options.policy, trust=options.trust)
    trained = get_task(model)
    step_s = choose_step_s(options.step_s, trained)
    steps = Task.make_for_step(step_s).steps
    best = None if options.optimum is None else read_best_reward(options.optimum, steps)
    policy = make_policy(model)
    env = prepare_env(_make_environment(options, step_s, trained), model)
    try:
        episodes = [run_episode(env, policy, options.seed + k) for k in range(options.episodes)]
    except ValueError as error:  # a policy of another task
        raise BadInputError(
            f"{options.policy}: expected a policy for observations (5,): {error}"
        ) from error
    finally:
        env.close()
    if options.video is not None:
        save_video(episodes[0], env.unwrapped.task, options.video)  # type: ignore[attr-defined]
    summary = summarise(episodes, steps)
    if best is not None:
        summary["share_of_optimum"] = summary["mean_reward"] / best
    if options.json:
        return json.dumps(summary, indent=2)
    video = [] if options.video is None else [str(options.video)]
    return "\n".join([format_summary(summary), *video])


def format_summary(summary: dict[str, Any]) -> str:
    """Return a summary as lines for a person."""
    mean, minimum = summary["mean_reward"], summary["min_reward"]
    lines = [
        f"{summary['episodes']} episodes: mean reward {mean:.1f}, minimum {minimum:.1f}: "
        f"{summary['words']}"
    ]
    if "share_of_optimum" in summary:
        lines.append(f"  {100 * summary['share_of_optimum']:.1f} % of the optimum")
    if (timing := summary["timing"]) is not None:
        median_ms, worst_ms = 1e3 * timing["median_delay_s"], 1e3 * timing["worst_delay_s"]
        lines.append(
            f"  commands left {median_ms:.1f} ms after the samples that they answer, "
            f"{worst_ms:.1f} ms at worst; {timing['missed']} after their step's end"
        )
    for row in summary["slices"]:
        low = "below" if row["from"] is None else f"{row['from']:g} to"
        high = "more" if row["to"] is None else f"{row['to']:g}"
        lines.append(f"  {low:>7} {high:<5} {row['episodes']:>4}  {row['means']}")
    return "\n".join(lines)


def _make_environment(
    options: argparse.Namespace, step_s: float, trained: Task | None
) -> gym.Env[Any, Any]:
    """Return where to play: with the largest command of the policy's training, if it is known."""
    common: dict[str, Any] = {
        "step_s": step_s,
        "pwm_limit": None if trained is None else trained.pwm_limit,
        "render_mode": "rgb_array" if options.video is not None else None,
        "max_episode_steps": Task.make_for_step(step_s).steps,
    }
    if options.rig is not None:
        return gym.make(OVER_TOPICS, namespace=options.rig, **common)
    twin = load_learnable_twin(options.twin)
    knowledge = gather_knowledge(twin, options.verdict, 0, options.seed)
    return gym.make(IN_PROCESS, twin=knowledge.twins[0], encoders=knowledge.encoders, **common)


if __name__ == "__main__":
    sys.exit(main())
