"""How a policy does: episodes run, counted and put into words."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

# Slices of an episode's reward, as in the thesis's table 6, and what one sees; the thesis's own
# wording is not at hand. Hanging at rest for 512 steps earns next to nothing; half the way up all
# the time, half; the best policies in the twin 480.
SLICES = (
    (-np.inf, 0.0, "ends early: the cart hits the end of its rail, or something moves too fast"),
    (0.0, 100.0, "hangs or swings a little, the cart on the rail"),
    (100.0, 200.0, "swings high, or turns over, and never stands"),
    (200.0, 300.0, "comes up, and falls again or stands for a short while"),
    (300.0, 400.0, "stands at the end, but comes up late, moves much, or stands off the middle"),
    (400.0, np.inf, "swings up at once and stands in the middle"),
)


@dataclass(frozen=True)
class Episode:
    """Hold one episode: summed reward, steps, why it ended ("none": it lasted), and all states (steps + 1, 4)."""

    reward: float
    steps: int
    end: str
    states: NDArray[np.float64]
    commands: NDArray[np.float64]
    timing: tuple[dict[str, float], ...] = ()

    @property
    def upright_share(self) -> float:
        """Return the share of steps in which the pole is within 0.2 rad of upright."""
        leaning = np.abs(np.remainder(self.states[1:, 1] + np.pi, 2 * np.pi) - np.pi)
        return float(np.mean(leaning < 0.2))


def describe_reward(reward: float) -> str:
    """Return what an episode with so much reward looks like."""
    return next(words for low, high, words in SLICES if low <= reward < high)


def run_episode(
    env: gym.Env[Any, Any], policy: Callable[[Any], Any], seed: int | None = None
) -> Episode:
    """Run one episode of a `PendulumEnv` (wrapped or not) with a policy: observation in, action out."""
    policy(
        np.zeros(env.observation_space.shape or (), dtype=np.float32)
    )  # whatever a first call costs is paid before the pendulum moves
    seen, info = env.reset(seed=seed)
    states, commands, timing, total = [info["state"]], [], [], 0.0
    over = False
    while not over:
        seen, gain, terminated, truncated, info = env.step(policy(seen))
        total += float(gain)
        states.append(info["state"])
        commands.append(info["applied_pwm"])
        timing.append({key: value for key, value in info.items() if isinstance(value, float)})
        over = terminated or truncated
    return Episode(
        total, len(commands), info["end"], np.array(states), np.array(commands), tuple(timing)
    )


def summarise(episodes: Sequence[Episode]) -> dict[str, Any]:
    """Return mean, minimum, spread and slices of several episodes, as `evaluate --json` prints them."""
    rewards = np.array([episode.reward for episode in episodes])
    slices = [
        {
            "from": None if low == -np.inf else low,
            "to": None if high == np.inf else high,
            "episodes": int(np.sum((rewards >= low) & (rewards < high))),
            "means": words,
        }
        for low, high, words in SLICES
    ]
    return {
        "episodes": len(episodes),
        "mean_reward": float(rewards.mean()),
        "min_reward": float(rewards.min()),
        "max_reward": float(rewards.max()),
        "std_reward": float(rewards.std()),
        "mean_steps": float(np.mean([episode.steps for episode in episodes])),
        "upright_share": float(np.mean([episode.upright_share for episode in episodes])),
        "ends": {
            end: sum(episode.end == end for episode in episodes)
            for end in sorted({e.end for e in episodes})
        },
        "slices": slices,
        "words": describe_reward(float(rewards.mean())),
    }
