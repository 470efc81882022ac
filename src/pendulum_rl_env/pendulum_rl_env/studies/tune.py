"""Search better settings of a preset with Optuna; the study is kept on the disk and resumed.

The best settings are written as a preset file.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path

import numpy as np
import optuna
import yaml
from stable_baselines3.common.callbacks import BaseCallback

from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.in_process import load_learnable_twin
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.learning.learner import make_learner
from pendulum_rl_env.learning.on_rig import evaluate_mean_reward
from pendulum_rl_env.learning.preset import IN_PROCESS, Preset, load_preset
from pendulum_rl_env.studies.workers import add_engine_options, run_study
from pendulum_twin.command_line import make_whole_reader, run_command
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically
from pendulum_twin.model import Twin
from pendulum_twin.parser import Parser, add_common_options, complete

EVALUATIONS = 8  # of a trial; each may end it, when other trials were better by then

RUN = "python -m pendulum_rl_env.studies.tune"


def main(arguments: list[str] | None = None) -> int:
    """Run the search; return 0 when it is done, 1 when it could not be (the reason on stderr)."""
    options = _parse_options(arguments)
    resumable = f"the same command goes on with the study in {options.out}"
    return run_command("tune", lambda: _search(options), resumable)


def _search(options: argparse.Namespace) -> None:
    preset = load_preset(options.preset, IN_PROCESS)
    load_learnable_twin(options.twin)
    options.out = options.out.absolute()
    options.out.mkdir(parents=True, exist_ok=True)
    study = _open_study(options, options.seed)
    try:
        begin = len(study.trials)
        numbers = range(begin, begin + options.trials)
        run_study(partial(_try_settings, options=options), numbers, options)
        best = _suggest_preset(optuna.trial.FixedTrial(study.best_params), preset)
    except ValueError as error:  # another search's study, or no trial came to its end
        raise BadInputError(
            f"{options.out}: expected a study of this search, found otherwise: {error}"
        ) from error
    file = options.out / f"{options.preset}.yaml"
    content = {IN_PROCESS: {**asdict(best), "layers": list(best.layers)}}
    write_atomically(file, yaml.safe_dump(content, sort_keys=False))
    print(
        f"{file}: {study.best_value:.1f} after {len(study.trials)} trials; train with "
        f"--preset {file}"
    )


def _open_study(options: argparse.Namespace, seed: int) -> optuna.Study:
    """Return the study in the folder, which all workers share; a new study where there is none."""
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    return optuna.create_study(
        study_name=options.preset,
        storage=f"sqlite:///{options.out / 'study.db'}",
        direction="maximize",
        sampler=optuna.samplers.TPESampler(seed=seed),
        pruner=optuna.pruners.MedianPruner(n_startup_trials=5, n_warmup_steps=2),
        load_if_exists=True,
    )


def _try_settings(number: int, options: argparse.Namespace) -> None:
    """Do one trial of the study; its number makes its draw another than its neighbours'."""
    preset, twin = load_preset(options.preset, IN_PROCESS), load_learnable_twin(options.twin)
    study = _open_study(options, options.seed + number)
    study.optimize(lambda trial: _train_and_rate(trial, preset, twin, options), n_trials=1)


def _suggest_preset(trial: optuna.trial.BaseTrial, preset: Preset) -> Preset:
    """Return the preset with settings that the trial suggests."""
    rate = trial.suggest_float("learning_rate", 1e-4, 3e-3, log=True)
    one_minus_gamma = trial.suggest_float("one_minus_gamma", 3e-3, 5e-2, log=True)
    settings = {**preset.settings, "gamma": 1 - one_minus_gamma}
    if preset.algorithm == "ppo":
        settings["n_epochs"] = trial.suggest_int("n_epochs", 4, 20)
        settings["batch_size"] = trial.suggest_categorical("batch_size", [128, 256, 512, 1024])
        settings["clip_range"] = trial.suggest_float("clip_range", 0.1, 0.4)
    else:
        settings["batch_size"] = trial.suggest_categorical("batch_size", [128, 256, 512])
        settings["tau"] = trial.suggest_float("tau", 3e-3, 5e-2, log=True)
    return replace(preset, learning_rate=rate, settings=settings)


class _EvaluationCallback(BaseCallback):
    """Evaluate several times in a training, and end it where the pruner says so."""

    def __init__(self, trial: optuna.Trial, every: int, evaluation: FleetVecEnv) -> None:
        super().__init__()
        self._trial, self._every, self._evaluation = trial, every, evaluation
        self.means: list[float] = []

    def _on_step(self) -> bool:
        if self.num_timesteps < self._every * (len(self.means) + 1):
            return True
        self.means.append(evaluate_mean_reward(self.model, self._evaluation, 1))
        self._trial.report(self.means[-1], len(self.means))
        return not self._trial.should_prune()


def _train_and_rate(
    trial: optuna.Trial, preset: Preset, twin: Twin, options: argparse.Namespace
) -> float:
    """Return the mean reward of all evaluations: a high reward early counts."""
    tried, seed = _suggest_preset(trial, preset), options.seed + trial.number
    steps = options.timesteps or preset.timesteps
    fleet = Fleet([twin], tried.environments, spread=tried.start_spread, seed=seed)
    callback = _EvaluationCallback(
        trial, max(steps // EVALUATIONS, 1), FleetVecEnv(Fleet([twin], 1))
    )
    model = make_learner(tried, FleetVecEnv(fleet), seed, None)
    model.learn(steps, callback=callback)
    if len(callback.means) < EVALUATIONS and model.num_timesteps < steps:
        raise optuna.TrialPruned
    return float(np.mean(callback.means))


def _parse_options(arguments: list[str] | None) -> argparse.Namespace:
    parser = Parser(
        prog="tune",
        description=__doc__,
        examples=(
            f"{RUN} --preset fast --out out/tuned --trials 30",
            f"{RUN} --twin out/mine/twin.yaml --timesteps 200000 --out out/tuned",
        ),
    )
    add_common_options(parser)
    add, count = parser.add_argument, make_whole_reader(1)
    add("--preset", default="fast", help="where to begin")
    add("--twin", type=Path, help="twin file to learn on (default: the INTECO rig)")
    add("--out", type=Path, required=True, help="folder of the study")
    add("--trials", type=count, default=20, metavar="N", help="how many more")
    add("--timesteps", type=count, help="of each training (default: the preset's)")
    add("--seed", type=int, default=0, help="of the search and the trainings")
    add_engine_options(parser, "trials")
    complete(parser)
    return parser.parse_args(arguments)


if __name__ == "__main__":
    sys.exit(main())
