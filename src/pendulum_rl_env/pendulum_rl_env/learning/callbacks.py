"""What happens while stable-baselines3 learns: evaluations noted, the best kept, progress told."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import (
    BaseCallback,
    CallbackList,
    CheckpointCallback,
    EvalCallback,
)
from stable_baselines3.common.vec_env import VecEnv

from pendulum_rl_env.learning.preset import Preset
from pendulum_rl_env.learning.result import Result

CHECKPOINT_STEPS = 5000  # steps, as the thesis did
PROGRESS_PERIOD_S = 5.0


def note_evaluation(
    model: BaseAlgorithm, mean: float, result: Result, out: Path, wall_s: float
) -> None:
    """Put an evaluation into the result, on the disk too; the best policy so far is kept as `policy.zip`."""
    if result.note(model.num_timesteps, wall_s, mean):
        model.save(out / "policy.zip")
    result.timesteps = model.num_timesteps
    result.save(out / "result.json")


class Milestones(BaseCallback):
    """Note each evaluation in the result and on the disk; end the training at a mean of at least `until`."""

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
    """Say every few seconds how far it is, how well, how fast, and how long it will take."""

    def __init__(self, total: int, say: Callable[[str], None]) -> None:
        super().__init__()
        self._total, self._say = total, say
        self._begun_s = self._said_s = time.monotonic()

    def _on_training_start(self) -> None:
        self._begun_s = self._said_s = time.monotonic()
        self._first = self.num_timesteps

    def _on_step(self) -> bool:
        now_s = time.monotonic()
        if now_s - self._said_s >= PROGRESS_PERIOD_S:
            self._said_s = now_s
            rate = max(self.num_timesteps - self._first, 1) / (now_s - self._begun_s)
            recent = [episode["r"] for episode in self.model.ep_info_buffer or ()]
            mean = f"{np.mean(recent):.0f}" if recent else "none yet"
            left_s = max(self._total - self.num_timesteps, 0) / rate
            done = f"{self.num_timesteps:,} of {self._total:,} steps"
            self._say(
                f"{done}, mean reward {mean}, {rate:,.0f} steps/s, {_format_span(left_s)} left"
            )
        return True


def _format_span(seconds: float) -> str:
    return f"{seconds / 60:.0f} min" if seconds >= 120 else f"{seconds:.0f} s"


def make_callbacks(
    preset: Preset,
    evaluation: VecEnv,
    episodes: int,
    milestones: Milestones,
    progress: Progress,
    out: Path,
    count: int,
) -> CallbackList:
    """Return all of them; count: environments side by side, a step of which is so many timesteps."""
    evaluating = EvalCallback(
        evaluation,
        callback_after_eval=milestones,
        n_eval_episodes=episodes,
        eval_freq=max(preset.evaluate_every // count, 1),
        deterministic=True,
        verbose=0,
        warn=False,
    )
    keeping = CheckpointCallback(
        max(CHECKPOINT_STEPS // count, 1), str(out / "checkpoints"), name_prefix="policy"
    )
    return CallbackList([evaluating, keeping, progress])
