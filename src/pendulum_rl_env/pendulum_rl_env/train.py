"""Train a policy in the twin, or on a rig over topics: from a preset to `policy.zip` and `result.json`.

Ctrl-C saves what is learned so far; `--resume` goes on from the last checkpoint.
"""

from __future__ import annotations

import time

STARTED_S = time.monotonic()  # before torch is imported: start-up counts

import argparse  # noqa: E402
import re  # noqa: E402
import sys  # noqa: E402
from collections.abc import Callable  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402

import gymnasium as gym  # noqa: E402
from stable_baselines3.common.base_class import BaseAlgorithm  # noqa: E402
from stable_baselines3.common.monitor import Monitor  # noqa: E402
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv  # noqa: E402

from pendulum_rl_env.fleet import Fleet  # noqa: E402
from pendulum_rl_env.in_process import load_learnable_twin  # noqa: E402
from pendulum_rl_env.learning.algorithms import as_off_policy, load_policy, make_learner  # noqa: E402
from pendulum_rl_env.learning.callbacks import Milestones, Progress, make_callbacks  # noqa: E402
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv  # noqa: E402
from pendulum_rl_env.learning.on_rig import learn_on_rig  # noqa: E402
from pendulum_rl_env.learning.preset import IN_PROCESS, OVER_TOPICS, PRESETS, Preset, load_preset  # noqa: E402
from pendulum_rl_env.learning.result import Result  # noqa: E402
from pendulum_rl_env.posterior import Knowledge, gather_knowledge  # noqa: E402
from pendulum_rl_env.task import Task  # noqa: E402
from pendulum_twin.command_line import make_whole_reader, run_command  # noqa: E402
from pendulum_twin.errors import BadInputError  # noqa: E402

EVALUATION_EPISODES = 20  # episodes an evaluation
RIG_EVALUATION_EPISODES = 3  # each costs a quarter of a minute and a reset
REPLAY_FILE = "replay.pkl"


def main(arguments: list[str] | None = None) -> int:
    """Run `train`; return 0 when it is done, 1 when it could not or was interrupted (the reason on stderr)."""
    options = _parse_options(arguments)
    return run_command(
        "train", lambda: _train(options), f"what was saved before is in {options.out}"
    )


def _train(options: argparse.Namespace) -> int:
    preset = load_preset(options.preset, options.env)
    if options.rig is not None:
        preset = replace(preset, environments=1)
    last = _prepare_folder(options)
    training, evaluation = _make_environments(options, preset)
    try:
        model = _make_model(options, preset, training, last)
        return _learn(options, preset, model, evaluation)
    finally:
        training.close()
        evaluation.close()


def _learn(
    options: argparse.Namespace, preset: Preset, model: BaseAlgorithm, evaluation: VecEnv
) -> int:
    """Learn, whatever ends it, and save."""
    out, total = options.out, options.timesteps or preset.timesteps
    result = Result(options.env, options.preset, preset.algorithm, options.seed)
    milestones = Milestones(result, out, options.until, _measure_running_s)
    progress = Progress(total, _print_progress)
    first, begun_s = model.num_timesteps, _measure_running_s()
    try:
        if options.rig is None:
            every = make_callbacks(
                preset,
                evaluation,
                EVALUATION_EPISODES,
                milestones,
                progress,
                out,
                preset.environments,
            )
            model.learn(
                max(total - first, 1),
                callback=every,
                tb_log_name="run",
                reset_num_timesteps=first == 0,
            )
        else:
            learn_on_rig(
                model,
                total,
                preset.evaluate_every,
                RIG_EVALUATION_EPISODES,
                result,
                out,
                options.until,
                _measure_running_s,
                progress,
            )
    except KeyboardInterrupt:
        result.interrupted = True
    result.timesteps, result.wall_s = model.num_timesteps, round(_measure_running_s(), 3)
    result.steps_per_s = round(
        (model.num_timesteps - first) / max(_measure_running_s() - begun_s, 1e-9), 1
    )
    _save(model, out, result)
    if result.interrupted:
        print(
            f"train: interrupted after {result.timesteps} steps; saved in {out}, --resume goes on",
            file=sys.stderr,
        )
        return 1
    best = "not evaluated" if result.best_mean_reward is None else f"{result.best_mean_reward:.1f}"
    print(
        f"{out / 'policy.zip'}: best mean reward {best}, {result.timesteps:,} steps in {result.wall_s:.0f} s"
    )
    return 0


def _save(model: BaseAlgorithm, out: Path, result: Result) -> None:
    """Save the last state for `--resume`; it is also the policy when there was no evaluation."""
    (out / "checkpoints").mkdir(exist_ok=True)
    model.save(out / "checkpoints" / f"policy_{model.num_timesteps}_steps")
    remembering = as_off_policy(model)
    if remembering is not None:
        remembering.save_replay_buffer(out / REPLAY_FILE)
    if not (out / "policy.zip").exists():
        model.save(out / "policy.zip")
    result.save(out / "result.json")


def _prepare_folder(options: argparse.Namespace) -> Path | None:
    """Make the folder, or find the last checkpoint in it when it is to go on."""
    out: Path = options.out
    if options.resume:
        found = [
            (int(match[1]), path)
            for path in out.glob("checkpoints/policy_*_steps.zip")
            if (match := CHECKPOINT_NUMBER.search(path.name))
        ]
        if not found:
            raise BadInputError(
                f"{out}: expected checkpoints to go on from, found none: leave out --resume"
            )
        return max(found)[1]
    if (out / "result.json").exists() or (out / "policy.zip").exists():
        raise BadInputError(
            f"{out}: expected no training there, found one: give another --out, or --resume"
        )
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(
            f"{out}: expected a folder to write to, found {error.strerror}: name another"
        ) from error
    return None


CHECKPOINT_NUMBER = re.compile(r"policy_(\d+)_steps")


def _make_model(
    options: argparse.Namespace, preset: Preset, training: VecEnv, last: Path | None
) -> BaseAlgorithm:
    """Return a new learner, or one that goes on from a checkpoint, or begins with another's policy."""
    model = make_learner(preset, training, options.seed, options.out / "tensorboard")
    begun = last or options.init
    if begun is not None:
        before = load_policy(begun)
        if type(before) is not type(model):
            kinds = f"{type(model).__name__}, found one of {type(before).__name__}"
            raise BadInputError(
                f"{begun}: expected a policy of {kinds}: choose the preset that it was trained with"
            )
        try:
            model.set_parameters(before.get_parameters(), device="cpu")  # type: ignore[arg-type]
        except (RuntimeError, ValueError) as error:
            raise BadInputError(
                f"{begun}: expected the layers of preset {options.preset}, found others: {error}"
            ) from error
    remembering = as_off_policy(model)
    if last is not None:
        model.num_timesteps = load_policy(last).num_timesteps
        if remembering is not None and (options.out / REPLAY_FILE).exists():
            remembering.load_replay_buffer(options.out / REPLAY_FILE)
    return model


def _make_environments(options: argparse.Namespace, preset: Preset) -> tuple[VecEnv, VecEnv]:
    """Return where to learn and where to evaluate: two fleets, or twice the one rig."""
    if options.rig is not None:
        rig = DummyVecEnv(
            [lambda: Monitor(gym.make(OVER_TOPICS, namespace=options.rig, step_s=options.step_s))]
        )
        return rig, rig
    if options.env != IN_PROCESS:
        make: list[Callable[[], gym.Env]] = [lambda: Monitor(gym.make(options.env))]
        return _seed(DummyVecEnv(make * preset.environments), options.seed), _seed(
            DummyVecEnv(make), options.seed + 10**6
        )
    known: Knowledge = gather_knowledge(
        load_learnable_twin(options.twin), options.verdict, options.draws, options.seed
    )
    task = Task.make_for_step(options.step_s)
    training = Fleet(
        known.twins, preset.environments, task, known.encoders, preset.start_spread, options.seed
    )
    evaluation = Fleet(
        known.twins[:1], EVALUATION_EPISODES, task, known.encoders, 0.0, options.seed
    )
    return FleetVecEnv(training), FleetVecEnv(evaluation)


def _seed(env: VecEnv, seed: int) -> VecEnv:
    env.seed(seed)
    return env


def _measure_running_s() -> float:
    return time.monotonic() - STARTED_S


def _print_progress(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="train", description=" ".join((__doc__ or "").split()))
    add = parser.add_argument
    add(
        "--twin",
        type=Path,
        help="twin file to learn on (without one: the INTECO rig by its maker's constants)",
    )
    add("--timesteps", type=make_whole_reader(1), help="how many steps (the preset's)")
    add("--seed", type=int, default=0, help="of everything that is drawn (0)")
    add(
        "--out",
        type=Path,
        required=True,
        help="folder for policy.zip, result.json, checkpoints and tensorboard",
    )
    add(
        "--preset",
        default="fast",
        metavar="|".join(PRESETS),
        help="how to learn, or a YAML file of your own (fast)",
    )
    add(
        "--until",
        type=float,
        metavar="R",
        help="stop at the first evaluation with a mean reward of at least R",
    )
    add("--init", type=Path, metavar="POLICY.zip", help="begin with this policy, for fine-tuning")
    add(
        "--rig",
        metavar="NAMESPACE",
        help="learn on the rig of this namespace, over topics, in real time",
    )
    add(
        "--verdict",
        type=Path,
        help="verdict.json of the diagnosis that made the twin: learn on all rigs that it leaves possible",
    )
    add(
        "--draws",
        type=make_whole_reader(1),
        default=64,
        metavar="N",
        help="how many twins are drawn from the verdict (64)",
    )
    add("--step-s", type=float, default=0.03, metavar="S", help="from command to command (0.03)")
    add("--env", default=IN_PROCESS, help=f"another environment's id ({IN_PROCESS})")
    add("--resume", action="store_true", help="go on from the last checkpoint in --out")
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
