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


class Rollout:
    """Hold the latest steps of all environments, and the rewards of the episodes that ended.

    Arrays are (STEPS, ENVIRONMENTS, ...); value has the state after the last step, too.
    """

    def __init__(self, inputs: int) -> None:
        self.seen = torch.zeros(STEPS, ENVIRONMENTS, inputs)
        self.action = torch.zeros(STEPS, ENVIRONMENTS, 1)
        self.log_p = torch.zeros(STEPS, ENVIRONMENTS)
        self.value = torch.zeros(STEPS + 1, ENVIRONMENTS)
        self.reward = torch.zeros(STEPS, ENVIRONMENTS)
        self.over = torch.zeros(STEPS, ENVIRONMENTS)
        self.episode_rewards: list[float] = []


@torch.no_grad()
def collect_steps(
    envs: gym.vector.VectorEnv, agent: Agent, seen: torch.Tensor, rollout: Rollout
) -> torch.Tensor:
    """Fill the rollout with steps from the observation seen on; return the last observation."""
    for k in range(STEPS):
        chosen = agent.choose(seen)
        action = chosen.sample()
        after, reward, ended, cut, info = envs.step(action.numpy().clip(-1.0, 1.0))
        reward = np.array(reward, dtype=np.float32)
        if cut.any():  # not the pendulum's end: what would have followed counts
            last = torch.as_tensor(info["final_obs"][cut])
            reward[cut] += GAMMA * agent.value(last)[:, 0].numpy()
        if (ended | cut).any():
            rollout.episode_rewards += list(info["final_info"]["episode"]["r"][ended | cut])
        rollout.seen[k], rollout.action[k] = seen, action
        rollout.log_p[k] = chosen.log_prob(action)[:, 0]
        rollout.value[k] = agent.value(seen)[:, 0]
        rollout.reward[k] = torch.as_tensor(reward)
        rollout.over[k] = torch.as_tensor(ended | cut)
        seen = torch.as_tensor(after)
    rollout.value[STEPS] = agent.value(seen)[:, 0]
    return seen


def compute_advantage(rollout: Rollout) -> torch.Tensor:
    """Return the generalised advantage (STEPS, ENVIRONMENTS) of the actions (Schulman, 2016)."""
    advantage, sum_ahead = torch.zeros(STEPS, ENVIRONMENTS), 0.0
    for k in reversed(range(STEPS)):
        goes_on = 1.0 - rollout.over[k]
        error = rollout.reward[k] + GAMMA * rollout.value[k + 1] * goes_on
        error -= rollout.value[k]
        sum_ahead = error + GAMMA * LAMBDA * goes_on * sum_ahead
        advantage[k] = sum_ahead
    return advantage


def improve_agent(agent: Agent, optimiser: torch.optim.Optimizer, rollout: Rollout) -> None:
    """Improve policy and value by the rollout, in batches."""
    advantage = compute_advantage(rollout)
    target = (advantage + rollout.value[:STEPS]).flatten()
    advantage = advantage.flatten()
    seen, action, log_p_before = (
        kept.flatten(0, 1) for kept in (rollout.seen, rollout.action, rollout.log_p)
    )
    for _ in range(EPOCHS):
        for batch in torch.randperm(len(target)).split(BATCH):
            chosen = agent.choose(seen[batch])
            log_p = chosen.log_prob(action[batch])[:, 0]
            ratio = (log_p - log_p_before[batch]).exp()
            gain = advantage[batch]
            gain = (gain - gain.mean()) / (gain.std() + 1e-8)
            worst = torch.minimum(gain * ratio, gain * ratio.clamp(1 - CLIP, 1 + CLIP))
            off = agent.value(seen[batch])[:, 0] - target[batch]
            loss = -worst.mean() + 0.5 * (off**2).mean()
            optimiser.zero_grad()
            loss.backward()
            nn.utils.clip_grad_norm_(agent.parameters(), LARGEST_GRADIENT)
            optimiser.step()


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
    agent, rollout = Agent(inputs), Rollout(inputs)
    optimiser = torch.optim.Adam(agent.parameters(), lr=LEARNING_RATE, eps=1e-5)
    seen = torch.as_tensor(envs.reset(seed=options.seed)[0])
    started_s = time.monotonic()
    for update in range(1, options.timesteps // (STEPS * ENVIRONMENTS) + 1):
        seen = collect_steps(envs, agent, seen, rollout)
        improve_agent(agent, optimiser, rollout)
        steps, latest = update * STEPS * ENVIRONMENTS, rollout.episode_rewards[-50:]
        mean = f"{np.mean(latest):.0f}" if latest else "none yet"
        rate = steps / (time.monotonic() - started_s)
        print(f"{steps:,} steps, mean reward {mean}, {rate:,.0f} steps/s", flush=True)
    envs.close()


if __name__ == "__main__":
    main()
