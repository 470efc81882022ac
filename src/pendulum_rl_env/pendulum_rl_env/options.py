"""The command lines of `train` and `evaluate`, without torch: help comes at once."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_rl_env.names import IN_PROCESS, OVER_TOPICS, PRESETS
from pendulum_twin.command_line import make_number_reader, make_whole_reader
from pendulum_twin.parser import Parser, add_common_options, complete, offer

LARGEST_SEED = 4_000_000_000  # numpy takes 2**32 - 1; the seed of the evaluation is 10**6 more
REWARDS = (-1e6, 1e6)  # means that --until takes: no episode has so many steps


def parse_train_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the options of `train`; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="train",
        description="Train a policy in the twin, or on a rig over topics, from a preset. Writes "
        "policy.zip and result.json. Ctrl-C saves what is learned so far; --resume continues from "
        "the last checkpoint.",
        examples=(
            "train --twin out/mine/twin.yaml --out out/policy",
            "train --twin twin.yaml --verdict verdict.json --timesteps 100000 --out out/policy",
            "train --rig rig --preset frugal --init out/policy/policy.zip --out out/tuned",
        ),
    )
    add_common_options(parser)
    add, count = parser.add_argument, make_whole_reader(1)
    seed, reward = make_whole_reader(0, LARGEST_SEED), make_number_reader(*REWARDS)
    twin = "twin file to learn on (without one: the INTECO rig by its maker's constants)"
    add("--twin", type=Path, help=twin)
    add("--timesteps", type=count, help="how many steps (default: the preset's)")
    add("--seed", type=seed, default=0, help="of everything random")
    out = "folder for policy.zip, result.json, checkpoints and tensorboard"
    add("--out", type=Path, required=True, help=out)
    preset = f"how to learn: {', '.join(PRESETS)}, or a YAML file of your own"
    offer(add("--preset", default="fast", metavar="PRESET", help=preset), PRESETS)
    until = "stop at the first evaluation with a mean reward of at least R"
    add("--until", type=reward, metavar="R", help=until)
    init = "begin with this policy, for fine-tuning: its largest command and its sample time hold"
    add("--init", type=Path, metavar="POLICY.zip", help=init)
    trust = (
        "read files of stable-baselines3 as --init, too, which may run any code (not the default)"
    )
    add("--trust", action="store_true", help=trust)
    rig = "learn on the rig of this namespace, over topics, in real time"
    add("--rig", metavar="NAMESPACE", help=rig)
    verdict = "verdict.json of the twin's diagnosis: learn on all rigs that it leaves possible"
    add("--verdict", type=Path, help=verdict)
    draws = "how many twins are drawn from the verdict"
    add("--draws", type=count, default=64, metavar="N", help=draws)
    step = "from command to command (default: that of --init or --resume, else 0.03)"
    add("--step-s", type=float, metavar="S", help=step)
    add("--env", default=IN_PROCESS, help="another environment's id")
    add("--resume", action="store_true", help="go on from the last checkpoint in --out")
    onnx = "also write policy.onnx: measured state in, PWM fraction out"
    add("--onnx", action="store_true", help=onnx)
    complete(parser)
    options = parser.parse_args(arguments)
    if mistake := _find_train_mistake(options):
        parser.error(mistake)
    return options


def _find_train_mistake(options: argparse.Namespace) -> str | None:
    """Return what does not go together in the options of `train`, as a sentence; else None."""
    is_other_task = options.env not in (IN_PROCESS, OVER_TOPICS)
    if options.onnx and is_other_task:
        return f"--onnx: expected the task of {IN_PROCESS}, found --env {options.env}"
    if options.rig is not None:
        if is_other_task:
            return f"--rig: expected no other task, found --env {options.env}: leave out either"
        return _find_rig_mistake(options)
    if options.env == OVER_TOPICS:
        return (
            f"--env {OVER_TOPICS}: expected the one rig to learn on, found none: give --rig "
            "NAMESPACE"
        )
    given = {"--twin": options.twin, "--verdict": options.verdict, "--step-s": options.step_s}
    unused = [name for name, value in given.items() if value is not None]
    if is_other_task and unused:
        return (
            f"{unused[0]}: expected the task of {IN_PROCESS}, found --env {options.env}, which "
            "has no use for it: leave it out"
        )
    return None


def _find_rig_mistake(options: argparse.Namespace) -> str | None:
    """Return what is of no use beside --rig, as a sentence; else None."""
    if options.rig is not None and options.verdict is not None:
        return (
            "--verdict: expected --twin alone, for it says how finely a twin is measured and "
            f"which twins are possible, found --rig {options.rig}: leave out either"
        )
    return None


def parse_evaluate_options(arguments: list[str] | None) -> argparse.Namespace:
    """Return the options of `evaluate`; print the mistake and exit with 2 for wrong use."""
    parser = Parser(
        prog="evaluate",
        description="Evaluate a policy without exploration: episodes from hanging at rest, in the "
        "twin or on a rig. A rig is reached over topics, in real time.",
        examples=(
            "evaluate --policy out/policy/policy.zip --twin out/mine/twin.yaml",
            "evaluate --policy policy.zip --twin twin.yaml --episodes 1 --video episode.mp4",
            "evaluate --policy policy.zip --rig rig --episodes 3 --json",
        ),
    )
    add_common_options(parser)
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
    add("--episodes", type=count, default=20, metavar="N", help="how many")
    seed, seeded = (
        make_whole_reader(0, LARGEST_SEED),
        "of the first episode; a twin alone draws nothing",
    )
    add("--seed", type=seed, default=0, help=seeded)
    step = "from command to command (default: as in the policy's training)"
    add("--step-s", type=float, metavar="S", help=step)
    video = "also write the first episode as a video"
    add("--video", type=Path, metavar="FILE.mp4|FILE.gif", help=video)
    add("--json", action="store_true", help="print one JSON object")
    complete(parser)
    options = parser.parse_args(arguments)
    if mistake := _find_rig_mistake(options):
        parser.error(mistake)
    return options
