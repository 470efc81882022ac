"""What happens while stable-baselines3 learns: evaluations, checkpoints, progress."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import (
    BaseCallback,
    CallbackList,
    EvalCallback,
)
from stable_baselines3.common.vec_env import VecEnv

from pendulum_rl_env.learning.policies import save_policy
from pendulum_rl_env.learning.preset import Preset
from pendulum_rl_env.learning.result import Result

CHECKPOINT_STEPS = 5000  # from checkpoint to checkpoint, as in the thesis
PROGRESS_PERIOD_S = 5.0


def note_evaluation(
    model: BaseAlgorithm, mean: float, result: Result, out: Path, wall_s: float
) -> None:
    """Put an evaluation into the result and on the disk; keep the best policy as `policy.zip`."""
    if result.note(model.num_timesteps, wall_s, mean):
        save_policy(model, out / "policy.zip")
    result.timesteps = model.num_timesteps
    result.save(out / "result.json")


def keep_checkpoint(model: BaseAlgorithm, out: Path) -> None:
    """Write the learner as it is now among the checkpoints of a folder, for `--resume`."""
    save_policy(model, out / "checkpoints" / f"policy_{model.num_timesteps}_steps.zip")


class Checkpoints(BaseCallback):
    """Keep a checkpoint every so many steps of all environments together.

    period: steps.
    out: folder of the training.
    """

    def __init__(self, period: int, out: Path) -> None:
        super().__init__()
        self._period, self._out = period, out

    def _on_step(self) -> bool:
        if self.n_calls % self._period == 0:
            keep_checkpoint(self.model, self._out)
        return True


class Milestones(BaseCallback):
    """Note every evaluation, and end the training at a mean reward of at least `until`.

    result: takes the evaluations.
    out: folder of policy and result.
    until: mean reward; None never ends the training.
    clock: s since the start of the program.
    """

    def __init__(
        self, result: Result, out: Path, until: float | None, clock: Callable[[], float]
    ) -> None:
        super().__init__()
        self._result, self._out, self._until, self._clock = result, out, until, clock

    def _on_step(self) -> bool:
        assert isinstance(self.parent, EvalCallback)
        mean = float(self.parent.last_mean_reward)
        note_evaluation(self.model, mean, self._result, self._out, self._clock())
        return self._until is None or mean < self._until


class Progress(BaseCallback):
    """Report every few seconds the steps done, their reward and rate, and the time left.

    total: timesteps of the training.
    say: takes each line.
    """

    def __init__(self, total: int, say: Callable[[str], None]) -> None:
        super().__init__()
        self._total, self._say = total, say
        self._start_s = self._said_s = time.monotonic()

    def _on_training_start(self) -> None:
        self._start_s = self._said_s = time.monotonic()
        self._first_step = self.num_timesteps

    def _on_step(self) -> bool:
        now_s = time.monotonic()
        if now_s - self._said_s >= PROGRESS_PERIOD_S:
            self._said_s = now_s
            self._say(self._describe(now_s))
        return True

    def _describe(self, now_s: float) -> str:
        rate = max(self.num_timesteps - self._first_step, 1) / (now_s - self._start_s)
        recent = [episode["r"] for episode in self.model.ep_info_buffer or ()]
        mean = f"{np.mean(recent):.0f}" if recent else "none yet"
        left = _format_span(max(self._total - self.num_timesteps, 0) / rate)
        steps = f"{self.num_timesteps:,} of {self._total:,} steps"
        return f"{steps}, mean reward {mean}, {rate:,.0f} steps/s, {left} left"


def _format_span(seconds: float) -> str:
    return f"{seconds / 60:.0f} min" if seconds >= 120 else f"{seconds:.0f} s"


def make_callbacks(
    preset: Preset,
    evaluation: VecEnv,
    episodes: int,
    milestones: Milestones,
    progress: Progress,
    out: Path,
) -> CallbackList:
    """Return evaluation, checkpoints and progress as one callback.

    preset: says how often to evaluate, and how many timesteps a step of all environments is.
    evaluation: where to evaluate.
    episodes: of an evaluation.
    milestones, progress: called at evaluations and steps.
    out: folder of the checkpoints.
    """
    evaluating = EvalCallback(
        evaluation,
        callback_after_eval=milestones,
        n_eval_episodes=episodes,
        eval_freq=max(preset.evaluate_every // preset.environments, 1),
        deterministic=True,
        verbose=0,
        warn=False,
    )
    keeping = Checkpoints(max(CHECKPOINT_STEPS // preset.environments, 1), out)
    return CallbackList([evaluating, keeping, progress])
