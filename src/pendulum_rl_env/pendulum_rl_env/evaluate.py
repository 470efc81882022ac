"""Evaluate a policy without exploration: episodes from hanging at rest, in the twin or on a rig.

A rig is reached over topics, in real time.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym

from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.policies import load_policy, make_policy, show_history
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS
from pendulum_rl_env.optimum_file import read_best_reward
from pendulum_rl_env.posterior import gather_knowledge
from pendulum_rl_env.scoring import run_episode, summarise
from pendulum_rl_env.task import Task
from pendulum_rl_env.video import check_video_path, save_video
from pendulum_twin.command_line import add_version, make_whole_reader, run_command
from pendulum_twin.errors import BadInputError


def main(arguments: list[str] | None = None) -> int:
    """Run `evaluate`; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command("evaluate", lambda: print(_evaluate(options)), "the drive is at PWM 0")


def _evaluate(options: argparse.Namespace) -> str:
    if options.video is not None:
        check_video_path(options.video)
    steps = Task.make_for_step(options.step_s).steps
    best = None if options.optimum is None else read_best_reward(options.optimum, steps)
    model = load_policy(options.policy, trust=options.trust)
    policy = make_policy(model)
    env = show_history(_make_environment(options), model)
    try:
        episodes = [run_episode(env, policy, options.seed + k) for k in range(options.episodes)]
    except BadInputError:
        raise
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
    return json.dumps(summary, indent=2) if options.json else format_summary(summary)


def format_summary(summary: dict[str, Any]) -> str:
    """Return a summary as lines for a person."""
    mean, minimum = summary["mean_reward"], summary["min_reward"]
    lines = [
        f"{summary['episodes']} episodes: mean reward {mean:.1f}, minimum {minimum:.1f}: "
        f"{summary['words']}"
    ]
    if "share_of_optimum" in summary:
        lines.append(f"  {100 * summary['share_of_optimum']:.1f} % of the optimum")
    for row in summary["slices"]:
        low = "below" if row["from"] is None else f"{row['from']:g} to"
        high = "more" if row["to"] is None else f"{row['to']:g}"
        lines.append(f"  {low:>7} {high:<5} {row['episodes']:>4}  {row['means']}")
    return "\n".join(lines)


def _make_environment(options: argparse.Namespace) -> gym.Env[Any, Any]:
    common: dict[str, Any] = {
        "step_s": options.step_s,
        "render_mode": "rgb_array" if options.video is not None else None,
        "max_episode_steps": Task.make_for_step(options.step_s).steps,
    }
    if options.rig is not None:
        return gym.make(OVER_TOPICS, namespace=options.rig, **common)
    twin = load_learnable_twin(options.twin)
    knowledge = gather_knowledge(twin, options.verdict, 0, options.seed)
    return gym.make(IN_PROCESS, twin=knowledge.twins[0], encoders=knowledge.encoders, **common)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="evaluate", description=" ".join((__doc__ or "").split())
    )
    add_version(parser)
    add = parser.add_argument
    count = make_whole_reader(1)
    file = "what `train` has written"
    add("--policy", type=Path, required=True, metavar="POLICY.zip", help=file)
    trust = (
        "read a policy file of stable-baselines3, too, which may run any code (not the default)"
    )
    add("--trust", action="store_true", help=trust)
    where = parser.add_mutually_exclusive_group(required=True)
    where.add_argument("--twin", type=Path, help="twin file")
    rig = "the rig of this namespace, over topics, in real time"
    where.add_argument("--rig", metavar="NAMESPACE", help=rig)
    add("--verdict", type=Path, help="verdict.json: measure as finely as that recording's rig did")
    optimum = "what `studies.optimum` has written: give the mean as a share of it, too"
    add("--optimum", type=Path, metavar="FILE.json", help=optimum)
    add("--episodes", type=count, default=20, metavar="N", help="how many (20)")
    add("--seed", type=int, default=0, help="of the first episode (0); a twin alone draws nothing")
    add("--step-s", type=float, default=0.03, metavar="S", help="from command to command (0.03)")
    video = "also write the first episode as a video"
    add("--video", type=Path, metavar="FILE.mp4|FILE.gif", help=video)
    add("--json", action="store_true", help="print one JSON object")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
