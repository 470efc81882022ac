"""Train a policy in the twin, or on a rig over topics, from a preset.

Writes `policy.zip`, `result.json` and `curves.png`. Ctrl-C saves what is learned so far;
`--resume` continues from the last checkpoint.
"""

from __future__ import annotations

import time

STARTED_S = time.monotonic()  # before torch is imported: start-up counts

import argparse  # noqa: E402
import re  # noqa: E402
import sys  # noqa: E402
from collections.abc import Callable  # noqa: E402
from contextlib import suppress  # noqa: E402
from dataclasses import replace  # noqa: E402
from pathlib import Path  # noqa: E402

from stable_baselines3.common.base_class import BaseAlgorithm  # noqa: E402
from stable_baselines3.common.vec_env import VecEnv  # noqa: E402

from pendulum_rl_env.control.base import design_base  # noqa: E402
from pendulum_rl_env.correction import Correction  # noqa: E402
from pendulum_rl_env.in_process import load_learnable_twin  # noqa: E402
from pendulum_rl_env.learning.callbacks import (  # noqa: E402
    Milestones,
    Progress,
    keep_checkpoint,
    make_callbacks,
    note_evaluation,
)
from pendulum_rl_env.learning.curves import draw_curves  # noqa: E402
from pendulum_rl_env.learning.environments import (  # noqa: E402
    EVALUATION_EPISODES,
    make_environments,
)
from pendulum_rl_env.learning.export import export  # noqa: E402
from pendulum_rl_env.learning.learner import (  # noqa: E402
    as_off_policy,
    explore_by_policy,
    make_learner,
)
from pendulum_rl_env.learning.on_rig import evaluate_mean_reward, learn_on_rig  # noqa: E402
from pendulum_rl_env.learning.policies import (  # noqa: E402
    get_correction,
    get_task,
    load_policy,
    save_policy,
)
from pendulum_rl_env.learning.preset import (  # noqa: E402
    IN_PROCESS,
    OVER_TOPICS,
    Preset,
    load_preset,
)
from pendulum_rl_env.learning.replay_file import load_replay, save_replay  # noqa: E402
from pendulum_rl_env.learning.result import Result  # noqa: E402
from pendulum_rl_env.learning.tensors import collect_tensors, put_tensors  # noqa: E402
from pendulum_rl_env.options import parse_train_options  # noqa: E402
from pendulum_rl_env.task import Task, choose_step_s  # noqa: E402
from pendulum_twin.command_line import INTERRUPTED, run_command  # noqa: E402
from pendulum_twin.errors import BadInputError, RigError  # noqa: E402

RIG_EVALUATION_EPISODES = 3  # each takes 15 s and a reset
REPLAY_FILE = "replay.npz"
CHECKPOINT_NUMBER = re.compile(r"policy_(\d+)_steps")


def main(arguments: list[str] | None = None, started_s: float = STARTED_S) -> int:
    """Run `train`; return 0 when it is done, 1 when it could not be, 130 after Ctrl-C.

    The reason is on stderr.

    started_s: monotonic time, s, from which the wall time counts.
    """
    options = parse_train_options(arguments)
    options.started_s = started_s
    saved = f"{options.out} holds what was saved before, if anything was"
    return run_command("train", lambda: _train(options), saved)


def _train(options: argparse.Namespace) -> int:
    preset = load_preset(options.preset, options.env)
    if options.rig is not None:
        preset = replace(preset, environments=1)
    options.timesteps = options.timesteps or preset.timesteps
    checkpoint = _prepare_folder(options)
    trained = _find_task(options, checkpoint)
    options.step_s = choose_step_s(options.step_s, trained)
    correction = _find_correction(options, preset, checkpoint) if preset.correction else None
    limit = None if trained is None else trained.pwm_limit
    training, evaluation = make_environments(options, preset, correction, limit)
    try:
        model = _make_model(options, preset, training, checkpoint, correction)
        is_complete = checkpoint is not None and model.num_timesteps >= options.timesteps
        result = None if is_complete else _learn(options, preset, model, evaluation)
    finally:
        training.close()
        evaluation.close()
    if options.onnx:
        policy = load_policy(options.out / "policy.zip")
        export(policy, get_task(policy) or Task(), options.out / "policy.onnx")
    if result is None:
        steps = f"{model.num_timesteps:,} of {options.timesteps:,} steps"
        print(
            f"{options.out / 'policy.zip'}: the training is complete, {steps}: give a larger "
            "--timesteps to go on"
        )
        return 0
    return _report(options, result)


def _learn(
    options: argparse.Namespace, preset: Preset, model: BaseAlgorithm, evaluation: VecEnv
) -> Result:
    """Learn until the end or Ctrl-C, save, and return the result.

    A rig that fails leaves as much: what it has taught is saved before the RigError goes on.
    """
    environment = options.env if options.rig is None else OVER_TOPICS
    result = Result(environment, options.preset, preset.algorithm, options.seed)
    if options.resume:
        result.go_on(options.out / "result.json")
    measure_s = _make_stopwatch(options.started_s)
    first, start_s = model.num_timesteps, measure_s()

    def finish() -> None:
        result.timesteps, result.wall_s = model.num_timesteps, round(measure_s(), 3)
        learning_s = max(measure_s() - start_s, 1e-9)
        result.steps_per_s = round((model.num_timesteps - first) / learning_s, 1)
        _save(model, options.out, result)

    try:
        _run_learning(options, preset, model, evaluation, result)
    except KeyboardInterrupt:
        result.interrupted = True
    except RigError:
        if model.num_timesteps > first:
            finish()
            _say_saved("stopped", options, result)
        raise
    finish()
    return result


def _run_learning(
    options: argparse.Namespace,
    preset: Preset,
    model: BaseAlgorithm,
    evaluation: VecEnv,
    result: Result,
) -> None:
    out, until, measure_s = options.out, options.until, _make_stopwatch(options.started_s)
    total, first = options.timesteps, model.num_timesteps
    progress = Progress(total, _ignore if options.quiet else _print_progress)
    episodes = EVALUATION_EPISODES if options.rig is None else RIG_EVALUATION_EPISODES
    if first == 0 and (preset.correction or options.init is not None):
        mean = evaluate_mean_reward(model, evaluation, episodes)
        note_evaluation(model, mean, result, out, measure_s())
        if until is not None and mean >= until:
            return
    if options.rig is not None:
        every = preset.evaluate_every
        learn_on_rig(model, total, every, episodes, result, out, until, measure_s, progress)
        return
    milestones = Milestones(result, out, until, measure_s)
    model.learn(
        max(total - first, 1),
        callback=make_callbacks(preset, evaluation, episodes, milestones, progress, out),
        tb_log_name="run",
        reset_num_timesteps=first == 0,
    )


def _report(options: argparse.Namespace, result: Result) -> int:
    """Print what came of the training; return the exit status."""
    if result.interrupted:
        _say_saved("interrupted", options, result)
        return INTERRUPTED
    best = "not evaluated" if result.best_mean_reward is None else f"{result.best_mean_reward:.1f}"
    print(
        f"{options.out / 'policy.zip'}: best mean reward {best}, {result.timesteps:,} steps in "
        f"{result.wall_s:.0f} s"
    )
    return 0


def _say_saved(how: str, options: argparse.Namespace, result: Result) -> None:
    print(
        f"train: {how} after {result.timesteps} steps; saved in {options.out}, --resume goes on",
        file=sys.stderr,
    )


def _save(model: BaseAlgorithm, out: Path, result: Result) -> None:
    """Save the last state for `--resume`; without an evaluation it is the policy, too."""
    keep_checkpoint(model, out)
    off_policy = as_off_policy(model)
    if off_policy is not None:
        save_replay(off_policy, out / REPLAY_FILE)
    if not (out / "policy.zip").exists():
        save_policy(model, out / "policy.zip")
    result.save(out / "result.json")
    draw_curves(result, out / "curves.png")


def _prepare_folder(options: argparse.Namespace) -> Path | None:
    """Return the last checkpoint for `--resume`; else try to make the folder and return None.

    The first file makes the folder for good: what is refused until then leaves nothing.
    """
    out: Path = options.out
    if options.resume:
        checkpoints = {
            int(match[1]): path
            for path in out.glob("checkpoints/policy_*_steps.zip")
            if (match := CHECKPOINT_NUMBER.search(path.name))
        }
        if not checkpoints:
            raise BadInputError(
                f"{out}: expected checkpoints to go on from, found none: leave out --resume"
            )
        return checkpoints[max(checkpoints)]
    if (out / "result.json").exists() or (out / "policy.zip").exists():
        raise BadInputError(
            f"{out}: expected no training there, found one: give another --out, or --resume"
        )
    missing = [folder for folder in (out, *out.parents) if not folder.exists()]
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BadInputError(
            f"{out}: expected a folder to write to, found {error.strerror}: name another"
        ) from error
    finally:
        with suppress(OSError):
            for folder in missing:
                folder.rmdir()
    return None


def _make_model(
    options: argparse.Namespace,
    preset: Preset,
    training: VecEnv,
    checkpoint: Path | None,
    correction: Correction | None,
) -> BaseAlgorithm:
    """Return a new learner, with the weights of a checkpoint or of `--init` if there is one."""
    model = make_learner(preset, training, options.seed, options.out / "tensorboard", correction)
    origin = checkpoint or options.init
    off_policy = as_off_policy(model)
    if origin is not None:
        saved = load_policy(origin, trust=options.trust)
        _take_weights(model, saved, origin, options.preset)
        model.num_timesteps = saved.num_timesteps if checkpoint is not None else 0
        if checkpoint is None and off_policy is not None:
            explore_by_policy(off_policy)
    replay = options.out / REPLAY_FILE
    if checkpoint is not None and off_policy is not None and replay.exists():
        load_replay(off_policy, replay)
    return model


def _find_task(options: argparse.Namespace, checkpoint: Path | None) -> Task | None:
    """Return the task of the policy that training begins with; None where nothing says it."""
    origin = checkpoint or options.init
    return None if origin is None else get_task(load_policy(origin, trust=options.trust))


def _find_correction(
    options: argparse.Namespace, preset: Preset, checkpoint: Path | None
) -> Correction:
    """Return what the policy is to correct: the checkpoint's controller, or a designed one.

    Raises BadInputError where no controller can be designed, the policy cannot be written, or
    the policy to begin with corrects none.
    """
    if options.env != IN_PROCESS or options.rig is not None:
        raise BadInputError(
            f"preset {options.preset}: expected a twin to design a controller for, found a rig or "
            f"--env {options.env}: choose another preset"
        )
    if options.onnx:
        raise BadInputError(
            f"preset {options.preset}: expected no --onnx: the policy corrects a controller that "
            "runs the twin itself, which is no graph of tensors; policy.zip holds both"
        )
    origin = checkpoint or options.init
    if origin is not None:  # before the minute in which a controller is designed
        correction = get_correction(load_policy(origin, trust=options.trust))
        if correction is None:
            raise BadInputError(
                f"{origin}: expected a policy that corrects a controller, as preset "
                f"{options.preset} trains it, found one that stands alone: choose the preset "
                "that it was trained with"
            )
        if checkpoint is not None:
            return correction
    twin = load_learnable_twin(options.twin)
    task = Task.make_for_step(options.step_s).allow_commands(twin.rig)
    if not options.quiet:
        _print_progress("designing the controller that the policy corrects ...")
    return Correction(design_base(twin, task), preset.correction)


def _take_weights(model: BaseAlgorithm, saved: BaseAlgorithm, origin: Path, preset: str) -> None:
    """Copy the weights of a saved policy; raise BadInputError when it is of another kind."""
    if type(saved) is not type(model):
        raise BadInputError(
            f"{origin}: expected a policy of {type(model).__name__}, found one of "
            f"{type(saved).__name__}: choose the preset that it was trained with"
        )
    try:
        put_tensors(model, collect_tensors(saved))
    except ValueError as error:
        raise BadInputError(
            f"{origin}: expected the layers of preset {preset}, found others: {error}"
        ) from error


def _make_stopwatch(started_s: float) -> Callable[[], float]:
    return lambda: time.monotonic() - started_s


def _ignore(line: str) -> None:
    """Ignore a line that --quiet leaves out."""


def _print_progress(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    sys.exit(main())
