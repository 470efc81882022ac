"""PPO in one file on the vector environment, in the manner of CleanRL: torch and numpy alone.

    python examples/ppo_vector.py --timesteps 400000

The vector environment steps all pendulums in one compiled call and restarts an episode in the step
in which it ends (`AutoresetMode.SAME_STEP`): the observation before the restart is in
`info["final_obs"]`, the episode's reward in `info["final_info"]["episode"]["r"]`.
"""

import argparse
import time

import gymnasium as gym
import numpy as np
import torch
from torch import nn
from torch.distributions import Normal

import pendulum_rl_env  # noqa: F401 (registers the ids)

ID = "pendulum_rl_env/InvertedPendulum-v0"
ENVIRONMENTS, STEPS, EPOCHS, BATCH = 32, 128, 10, 512
LEARNING_RATE, GAMMA, LAMBDA, CLIP, LARGEST_GRADIENT = 1e-3, 0.99, 0.95, 0.2, 0.5


class Agent(nn.Module):
    """Hold the networks of policy and value."""

    def __init__(self, inputs: int) -> None:
        super().__init__()
        self.value, self.mean = (
            nn.Sequential(
                nn.Linear(inputs, 64), nn.Tanh(), nn.Linear(64, 64), nn.Tanh(), nn.Linear(64, 1)
            )
            for _ in range(2)
        )
        self.log_std = nn.Parameter(torch.zeros(1))

    def choose(self, seen: torch.Tensor) -> Normal:
        """Return the distribution of actions."""
        return Normal(self.mean(seen), self.log_std.exp())


def main() -> None:
    """Train, and print the mean reward of the episodes that ended."""
    parser = argparse.ArgumentParser(description="Train by PPO on the vector environment.")
    parser.add_argument("--timesteps", type=int, default=400_000, help="how many (400000)")
    parser.add_argument("--seed", type=int, default=0, help="of everything random (0)")
    options = parser.parse_args()
    torch.manual_seed(options.seed)
    torch.set_num_threads(1)  # the networks are small

    # three in ten episodes begin anywhere: standing is learned before swinging up is
    envs = gym.make_vec(ID, num_envs=ENVIRONMENTS, spread=0.3)
    inputs = envs.single_observation_space.shape[0]
    agent = Agent(inputs)
    optimiser = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)
    seen = torch.as_tensor(envs.reset(seed=options.seed)[0])
    kept = {
        "seen": torch.zeros(STEPS, ENVIRONMENTS, inputs),
        "action": torch.zeros(STEPS, ENVIRONMENTS, 1),
        "log_p": torch.zeros(STEPS, ENVIRONMENTS),
        "value": torch.zeros(STEPS + 1, ENVIRONMENTS),
        "reward": torch.zeros(STEPS, ENVIRONMENTS),
        "over": torch.zeros(STEPS, ENVIRONMENTS),
    }
    started_s, rewards = time.monotonic(), []
    for update in range(1, options.timesteps // (STEPS * ENVIRONMENTS) + 1):
        with torch.no_grad():
            for k in range(STEPS):
                chosen = agent.choose(seen)
                action = chosen.sample()
                after, reward, ended, cut, info = envs.step(action.numpy().clip(-1.0, 1.0))
                reward = np.array(reward, dtype=np.float32)
                if cut.any():  # not the pendulum's end: what would have followed counts
                    last = torch.as_tensor(info["final_obs"][cut])
                    reward[cut] += GAMMA * agent.value(last)[:, 0].numpy()
                if (ended | cut).any():
                    rewards += list(info["final_info"]["episode"]["r"][ended | cut])
                kept["seen"][k], kept["action"][k] = seen, action
                kept["log_p"][k] = chosen.log_prob(action)[:, 0]
                kept["value"][k] = agent.value(seen)[:, 0]
                kept["reward"][k] = torch.as_tensor(reward)
                kept["over"][k] = torch.as_tensor(ended | cut)
                seen = torch.as_tensor(after)
            kept["value"][STEPS] = agent.value(seen)[:, 0]
            advantage, sum_ahead = torch.zeros(STEPS, ENVIRONMENTS), 0.0
            for k in reversed(range(STEPS)):
                goes_on = 1.0 - kept["over"][k]
                error = kept["reward"][k] + GAMMA * kept["value"][k + 1] * goes_on
                error -= kept["value"][k]
                sum_ahead = error + GAMMA * LAMBDA * goes_on * sum_ahead
                advantage[k] = sum_ahead
            target = advantage + kept["value"][:STEPS]
        flat = {name: kept[name].flatten(0, 1) for name in ("seen", "action", "log_p")}
        advantage, target = advantage.flatten(), target.flatten()
        for _ in range(EPOCHS):
            for batch in torch.randperm(len(target)).split(BATCH):
                chosen = agent.choose(flat["seen"][batch])
                log_p = chosen.log_prob(flat["action"][batch])[:, 0]
                ratio = (log_p - flat["log_p"][batch]).exp()
                gain = advantage[batch]
                gain = (gain - gain.mean()) / (gain.std() + 1e-8)
                worst = torch.minimum(gain * ratio, gain * ratio.clamp(1 - CLIP, 1 + CLIP))
                off = agent.value(flat["seen"][batch])[:, 0] - target[batch]
                loss = -worst.mean() + 0.5 * (off**2).mean()
                optimiser.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), LARGEST_GRADIENT)
                optimiser.step()
        steps = update * STEPS * ENVIRONMENTS
        mean = f"{np.mean(rewards[-50:]):.0f}" if rewards else "none yet"
        rate = steps / (time.monotonic() - started_s)
        print(f"{steps:,} steps, mean reward {mean}, {rate:,.0f} steps/s", flush=True)
    envs.close()


if __name__ == "__main__":
    main()
