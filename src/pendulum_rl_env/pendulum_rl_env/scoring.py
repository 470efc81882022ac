"""Run episodes of a policy, and count and describe their rewards."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import gymnasium as gym
import numpy as np

from pendulum_twin.arrays import Floats

# Slices of an episode's reward and what the pendulum then does: the thesis's table 6, described in
# words of our own. 512 would be upright in the middle from the first step on.
SLICES = (
    (-np.inf, 50.0, "wanders along the rail and mostly leaves it"),
    (50.0, 100.0, "keeps to the rail, moves without order, and the pole turns over"),
    (100.0, 190.0, "stays near the middle; the pole turns more slowly and does not stay up"),
    (190.0, 300.0, "holds the pole up for short times, wherever the cart is"),
    (300.0, 400.0, "keeps the pole up while the cart drifts, at times to near the ends"),
    (400.0, np.inf, "keeps the pole up near the middle without sudden moves"),
)
STEPS = 512  # of the thesis's episode, by which the slices go
UPRIGHT_RAD = 0.2  # from upright: within it a step counts as upright


@dataclass(frozen=True)
class Episode:
    """Hold one episode.

    reward: summed over the episode.
    steps: how many.
    end: "rail", "cart_speed", "pole_speed", or "none" when the episode lasted.
    states: (steps + 1, 4) measured x, th, v, w.
    commands: (steps,) PWM fractions as applied.
    timing: figures of each step's `info`.
    """

    reward: float
    steps: int
    end: str
    states: Floats
    commands: Floats
    timing: tuple[dict[str, float], ...] = ()

    @property
    def upright_share(self) -> float:
        """Return the share of steps in which the pole is within 0.2 rad of upright."""
        lean = np.abs(np.remainder(self.states[1:, 1] + np.pi, 2 * np.pi) - np.pi)
        return float(np.mean(lean < UPRIGHT_RAD))


def describe_reward(reward: float) -> str:
    """Return what an episode with so much reward looks like."""
    return next(words for low, high, words in SLICES if low <= reward < high)


def run_episode(
    env: gym.Env[Any, Any], policy: Callable[[Any], Any], seed: int | None = None
) -> Episode:
    """Run one episode.

    env: a `PendulumEnv`, wrapped or not.
    policy: observation in, action out.
    seed: of the reset.
    """
    # A first call can be slow; it is made before the pendulum moves.
    policy(np.zeros(env.observation_space.shape or (), dtype=np.float32))
    observation, info = env.reset(seed=seed)
    states, commands, timing, total = [info["state"]], [], [], 0.0
    over = False
    while not over:
        observation, reward, terminated, truncated, info = env.step(policy(observation))
        total += float(reward)
        states.append(info["state"])
        commands.append(info["applied_pwm"])
        timing.append({key: value for key, value in info.items() if isinstance(value, float)})
        over = terminated or truncated
    return Episode(
        total, len(commands), info["end"], np.array(states), np.array(commands), tuple(timing)
    )


def summarise(episodes: Sequence[Episode], steps: int = STEPS) -> dict[str, Any]:
    """Return mean, minimum, spread and slices of episodes, as `evaluate --json` prints them.

    steps: of a whole episode. Rewards are counted a step, so slices and words go by the reward
        that 512 steps would have earned.

    Over topics "timing" says how long after the samples that they answered commands were sent
    (`median_delay_s`, `worst_delay_s`), and how many were sent after their step's end (`missed`);
    in process it is None.
    """
    rewards = np.array([episode.reward for episode in episodes])
    scaled = rewards * STEPS / steps
    slices = [
        {
            "from": None if low == -np.inf else low,
            "to": None if high == np.inf else high,
            "episodes": int(np.sum((scaled >= low) & (scaled < high))),
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
        "ends": dict(sorted(Counter(episode.end for episode in episodes).items())),
        "slices": slices,
        "words": describe_reward(float(scaled.mean())),
        "timing": _summarise_timing(episodes),
    }


def _summarise_timing(episodes: Sequence[Episode]) -> dict[str, float] | None:
    steps = [step for episode in episodes for step in episode.timing]
    delays_s = [step["delay_s"] for step in steps if "delay_s" in step]
    if not delays_s:
        return None
    last = [episode.timing[-1] for episode in episodes if episode.timing]
    return {
        "median_delay_s": float(np.median(delays_s)),
        "worst_delay_s": max(delays_s),
        "missed": int(sum(step.get("missed", 0.0) for step in last)),
    }
