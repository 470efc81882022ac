"""From an unknown rig to a controlled rig, in one command.

A minute of excitation, a diagnosis, a policy trained in the identified twin, and an episode on the
rig, which has seen no training step. The rig is emulated, with physics concealed by the seed.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import gymnasium as gym

from pendulum_rl_env.in_process import scale_actions
from pendulum_rl_env.learning.export import export
from pendulum_rl_env.learning.policies import (
    get_correction,
    get_task,
    load_policy,
    make_policy,
    prepare_env,
)
from pendulum_rl_env.scoring import Episode, describe_reward, run_episode
from pendulum_rl_env.studies import stages
from pendulum_rl_env.studies.stages import ConcealedRig
from pendulum_rl_env.task import Task
from pendulum_rl_env.video import save_video
from pendulum_twin.command_line import run_command
from pendulum_twin.errors import BadInputError
from pendulum_twin.parser import Parser, add_common_options, complete

KINDS = "single:1,pair:1"
RECORDED_S, EPISODE_S = 60.0, 15.4  # of the rig's own time

RUN = "python -m pendulum_rl_env.studies.identify_and_control"


def main(arguments: list[str] | None = None) -> int:
    """Run all stages; return 0 at their end, 1 when one could not be done (reason on stderr)."""
    options = _parse_options(arguments)
    ended = "all that it had started has ended"
    return run_command("identify_and_control", lambda: _identify_and_control(options), ended)


def _identify_and_control(options: argparse.Namespace) -> None:
    out: Path = options.out
    if out.exists() and any(out.iterdir()):
        raise BadInputError(f"{out}: expected an empty folder, or none: give another --out")
    report = (lambda _: None) if options.quiet else _say
    clock = Clock()
    report(
        "Recording a minute of excitation from a rig with something concealed "
        f"(seed {options.seed}) ..."
    )
    rig = stages.conceal(out, 0, options.seed, options.kinds, options.twin, RECORDED_S)
    clock.take("recording", RECORDED_S)  # the emulated rig is faster than its own time
    report("Diagnosing ...")
    diagnosis = stages.diagnose(rig, out / "diagnosis")
    clock.take("diagnosis")
    report(f"  {diagnosis.verdict['sentence']}")
    report("Designing a controller for the identified twin, and training its correction ...")
    how = ["--preset", options.preset, "--verdict", str(diagnosis.file)]
    policy = stages.train_until_good(diagnosis.twin, out / "policy", options.seed, how)
    clock.take("design and training")
    result = json.loads((policy.parent / "result.json").read_text(encoding="utf-8"))
    report(f"  in the twin: mean reward {result['best_mean_reward']:.0f}")
    episode = run_on_rig(rig, policy)
    clock.take("an episode on the rig", EPISODE_S)
    _show_on_rig(episode, policy, out)
    _say(str(clock))


class Clock:
    """Measure how long each part takes, s of wall time; a rig's own time counts as its own."""

    def __init__(self) -> None:
        self._parts: dict[str, float] = {}
        self._begin_s = time.monotonic()

    def take(self, part: str, rig_s: float | None = None) -> None:
        """End a part, and begin the next; rig_s: how long it takes on a rig in real time."""
        end_s = time.monotonic()
        self._parts[part] = end_s - self._begin_s if rig_s is None else rig_s
        self._begin_s = end_s

    def __str__(self) -> str:
        parts = ", ".join(f"{part} {seconds:.0f} s" for part, seconds in self._parts.items())
        return (
            f"Clock, from the first sample on: {parts}; {sum(self._parts.values()):.0f} s in all"
        )


def _show_on_rig(episode: Episode, policy: Path, out: Path) -> None:
    """Write policy and animation, and say how the episode went and where everything is."""
    network, video = policy, out / "episode.gif"
    model = load_policy(policy)
    task = get_task(model) or Task()
    if get_correction(model) is None:
        network = out / "policy.onnx"
        export(model, task, network)
    save_video(episode, task, video)
    _say(
        f"On the rig, with no training step there: reward {episode.reward:.0f}: "
        f"{describe_reward(episode.reward)}"
    )
    report = out / "diagnosis" / "report.html"
    _say(f"Report: {report}; policy: {network}; the episode: {video}")


def run_on_rig(rig: ConcealedRig, policy: Path) -> Episode:
    """Run an episode on the rig from hanging at rest; the emulated rig repeats bit by bit."""
    model = load_policy(policy)
    task = get_task(model) or Task()
    plain = gym.wrappers.TimeLimit(scale_actions(rig.make_env(task)), task.steps)
    env = prepare_env(plain, model)
    try:
        return run_episode(env, make_policy(model))
    finally:
        env.close()


def _say(line: str) -> None:
    print(line, flush=True)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="identify_and_control",
        description=__doc__,
        examples=(
            f"{RUN} --seed 3 --out out/control",
            f"{RUN} --seed 3 --kinds pair:1 --preset fast --out out/pair",
        ),
    )
    add_common_options(parser)
    add = parser.add_argument
    add("--seed", type=int, required=True, help="of what is concealed, and of the training")
    out = "folder for recording, seal, diagnosis, policy and episode"
    add("--out", type=Path, required=True, help=out)
    kinds = "how many effects are concealed, with the share of each kind"
    add("--kinds", default=KINDS, metavar="KIND:SHARE,...", help=kinds)
    add("--twin", type=Path, default=Path("config/inteco.yaml"), help="the nominal rig")
    add("--preset", default="residual", help="how the policy is trained")
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
