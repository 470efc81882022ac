"""From a rig that nobody knows to one under control, in one command.

A minute of excitation, a diagnosis, a policy trained in the identified twin, and an episode on the
rig, which has seen no training step. The rig is an emulated one with physics concealed by the
seed. Run as `python -m pendulum_rl_env.studies.identify_and_control --seed S --out DIR`.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import gymnasium as gym

from pendulum_rl_env.in_process import scale_actions
from pendulum_rl_env.learning.algorithms import load_policy, make_policy
from pendulum_rl_env.learning.export import export
from pendulum_rl_env.scoring import Episode, describe_reward, run_episode
from pendulum_rl_env.studies import stages
from pendulum_rl_env.studies.stages import ConcealedRig
from pendulum_rl_env.task import Task
from pendulum_rl_env.video import save_video
from pendulum_twin.command_line import run_command
from pendulum_twin.errors import BadInputError

KINDS = "single:1,pair:1"


def main(arguments: list[str] | None = None) -> int:
    """Run all of it; return 0 when it came to the end, 1 when it could not (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command(
        "identify_and_control",
        lambda: _identify_and_control(options),
        "all that it had started has ended",
    )


def _identify_and_control(options: argparse.Namespace) -> None:
    out: Path = options.out
    if out.exists() and any(out.iterdir()):
        raise BadInputError(f"{out}: expected an empty folder, or none: give another --out")
    print(
        f"Recording a minute of excitation from a rig with something concealed (seed {options.seed}) ...",
        flush=True,
    )
    rig = stages.conceal(out, 0, options.seed, options.kinds, options.twin)
    print("Diagnosing ...", flush=True)
    found = stages.diagnose(rig, out / "diagnosis")
    print(
        f"  {found.verdict['sentence']}\nTraining in the identified twin (about a minute on two idle cores) ...",
        flush=True,
    )
    how = ["--preset", options.preset, "--verdict", str(found.folder / "verdict.json")]
    policy = stages.train_until_good(found.twin, out / "policy", options.seed, how)
    learned = json.loads((policy.parent / "result.json").read_text(encoding="utf-8"))
    print(
        f"  in the twin: mean reward {learned['best_mean_reward']:.0f}, {learned['wall_s']:.0f} s",
        flush=True,
    )
    episode = run_on_rig(rig, policy)
    export(load_policy(policy), Task(), out / "policy.onnx")
    save_video(episode, Task(), out / "episode.gif")
    print(
        f"On the rig, with no training step there: reward {episode.reward:.0f}: {describe_reward(episode.reward)}"
    )
    print(
        f"Report: {out / 'diagnosis' / 'report.html'}; policy: {out / 'policy.onnx'}; the episode: {out / 'episode.gif'}"
    )


def run_on_rig(rig: ConcealedRig, policy: Path) -> Episode:
    """Run an episode on the rig, from hanging at rest; the rig repeats to the last bit, so one tells all."""
    task = Task()
    env = gym.wrappers.TimeLimit(scale_actions(rig.env(task)), task.steps)
    try:
        return run_episode(env, make_policy(load_policy(policy)))
    finally:
        env.close()


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="identify_and_control", description=" ".join((__doc__ or "").split())
    )
    add = parser.add_argument
    add("--seed", type=int, required=True, help="of what is concealed, and of the training")
    add(
        "--out",
        type=Path,
        required=True,
        help="folder for recording, seal, diagnosis, policy and episode",
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
    add("--preset", default="fast", help="how the policy is trained (fast)")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
