"""Learning beside the same PPO on Gymnasium's CartPole, and the environment's share of time.

Run as `python tests/bench/learning.py`. Both have 32 environments side by side and the settings of
the preset `fast`, one torch thread; the pendulum takes turns with its peer, medians of three.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
import torch
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.vec_env import VecEnv, VecEnvWrapper

from pendulum_rl_env.fleet import Fleet
from pendulum_rl_env.learning.fleet_vec_env import FleetVecEnv
from pendulum_rl_env.learning.learner import make_learner
from pendulum_rl_env.learning.preset import IN_PROCESS, load_preset
from pendulum_twin.inteco import INTECO


class Timed(VecEnvWrapper):
    """Add up the time spent in the environment."""

    def __init__(self, env: VecEnv) -> None:
        super().__init__(env)
        self.seconds = 0.0

    def reset(self):
        return self.venv.reset()

    def step_wait(self):
        begun = time.perf_counter()
        result = self.venv.step_wait()
        self.seconds += time.perf_counter() - begun
        return result


def measure_speed(make, steps: int) -> tuple[float, float]:
    """Return steps a second, and the environment's share of the time, in percent."""
    preset = replace(load_preset("fast", IN_PROCESS), start_spread=0.0)
    env = Timed(make(preset.environments))
    model = make_learner(preset, env, 1, None)
    model.learn(preset.environments * 128)  # whatever is compiled or paid once
    env.seconds, begun = 0.0, time.perf_counter()
    model.learn(steps)
    took = time.perf_counter() - begun
    return steps / took, 100 * env.seconds / took


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=81920)
    options = parser.parse_args()
    torch.set_num_threads(1)
    kinds = {
        "this task, the twin": lambda count: FleetVecEnv(Fleet([INTECO], count)),
        "Gymnasium CartPole": lambda count: make_vec_env("CartPole-v1", count),
    }
    found = {name: [] for name in kinds}
    for _ in range(3):
        for name, make in kinds.items():
            found[name].append(measure_speed(make, options.steps))
    medians = {name: np.median(values, axis=0) for name, values in found.items()}
    print(f"{'PPO, preset fast':<24}{'steps/s':>10}{'environment, % of time':>26}")
    for name, (rate, share) in medians.items():
        print(f"{name:<24}{rate:>10,.0f}{share:>26.1f}")
    ours, peer = medians.values()
    print(f"{'ratio':<24}{ours[0] / peer[0]:>10.2f}{ours[1] / peer[1]:>26.2f}")


if __name__ == "__main__":
    main()
