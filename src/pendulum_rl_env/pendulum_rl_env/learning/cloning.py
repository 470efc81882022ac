"""Begin with what the classical controller does: behaviour cloning before reinforcement learning.

In every twin that a diagnosis leaves possible a classical controller that knows this twin controls
it; its commands are disturbed, so that the demonstrations also show the way back (Laskey et al.,
DART: noise injection for robust imitation learning, 2017). The policy learns the commands, its
value the rewards that followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from stable_baselines3 import PPO
from torch.distributions import Normal
from torch.nn.functional import mse_loss

from pendulum_rl_env.control.classical import Classical, Tuning, make_plant
from pendulum_rl_env.history import History
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import Task, make_observation
from pendulum_twin.arrays import Floats
from pendulum_twin.encoders import Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

EPISODES = 32  # that are demonstrated, in all the twins in turn
MOST_TWINS = 16
NOISE_SHARE, NOISE_PERIODS = 0.25, 5  # of the PWM limit, and periods for which it stays the same
ASIDE_RAD = 0.1  # at most, from hanging, where a demonstration begins
EPOCHS, BATCH, LEARNING_RATE = 60, 512, 1e-3
VALUE_SHARE = 0.5  # of the value's error in the loss
LOG_STD = -1.5  # of the actions that are explored afterwards, in units of full PWM


@dataclass(frozen=True)
class Demonstrations:
    """Hold what experts did.

    observations: (n, ...) with history.
    actions: (n, 1) from -1 to 1, of the expert, without the noise.
    returns: (n,) discounted sums of rewards ahead.
    rewards: (episodes,) of whole episodes.
    """

    observations: Floats
    actions: Floats
    returns: Floats
    rewards: Floats


def demonstrate(
    twins: Sequence[Twin],
    task: Task,
    encoders: Encoders,
    history: int,
    gamma: float,
    seed: int,
    tuning: Tuning | None = None,
) -> Demonstrations:
    """Return episodes of classical controllers in twins, each designed for its own twin.

    twins: the first sixteen are demonstrated.
    history: past periods that an observation holds.
    gamma: discount a period.
    tuning: of all controllers; None for the usual numbers.

    Raises BadInputError when no twin can be balanced.
    """
    random = np.random.default_rng(seed)
    experts, refused = [], None
    for twin in twins[:MOST_TWINS]:
        try:
            experts.append((twin, Classical(make_plant(twin, task), tuning or Tuning())))
        except BadInputError as error:  # a draw at the edge of what is possible
            refused = error
    if refused is not None and not experts:
        raise refused
    episodes = []
    for number in range(EPISODES):
        twin, expert = experts[number % len(experts)]
        aside = float(random.uniform(-ASIDE_RAD, ASIDE_RAD))
        rig = KernelTransport(twin, task.step_s, encoders, aside)
        episodes.append(_run_episode(expert, rig, task, history, gamma, random))
    observations, actions, returns = (np.concatenate([e[k] for e in episodes]) for k in range(3))
    return Demonstrations(observations, actions, returns, np.array([e[3] for e in episodes]))


def _run_episode(
    expert: Classical,
    rig: KernelTransport,
    task: Task,
    history: int,
    gamma: float,
    random: np.random.Generator,
) -> tuple[Floats, Floats, Floats, float]:
    """Return observations, the expert's actions, returns, and the sum of rewards."""
    expert.reset()
    state = rig.reset().state
    past = History(1, 5, history)
    past.begin(slice(None), make_observation(state, task)[None])
    observations, actions, rewards, noise = [], [], [], 0.0
    for k in range(task.steps):
        if k % NOISE_PERIODS == 0:
            is_quiet = (k // 64) % 2  # half of the time the expert has its way
            noise = 0.0 if is_quiet else NOISE_SHARE * task.pwm_limit * random.standard_normal()
        wanted = expert(state)
        applied = min(max(wanted + noise, -task.pwm_limit), task.pwm_limit)
        expert.note_command(applied)
        observations.append(past.show()[0])
        actions.append([wanted / task.pwm_limit])
        state = rig.exchange(applied).state
        reward, end = compute_reward_and_end(*state.tolist(), task.limits, task.penalties)
        rewards.append(reward)
        action = np.array([[applied / task.pwm_limit]], dtype=np.float32)
        past.append(action, make_observation(state, task)[None])
        if end:
            break
    returns = np.zeros(len(rewards))
    ahead = 0.0 if end else rewards[-1] / (1.0 - gamma)  # it goes on as it ended
    for k in reversed(range(len(rewards))):
        ahead = returns[k] = rewards[k] + gamma * ahead
    return np.array(observations), np.array(actions), returns, float(sum(rewards))


def clone(model: PPO, shown: Demonstrations, seed: int) -> float:
    """Teach policy and value of a learner what was shown; return the policy's last mean error.

    The error is of actions, root mean square, in units of full PWM. Exploration then begins small.
    """
    generator = torch.Generator().manual_seed(seed)
    observations = torch.as_tensor(shown.observations, dtype=torch.float32)
    actions = torch.as_tensor(shown.actions, dtype=torch.float32)
    returns = torch.as_tensor(shown.returns, dtype=torch.float32)
    scale = float(returns.std()) or 1.0
    policy = model.policy
    optimiser = torch.optim.Adam(policy.parameters(), lr=LEARNING_RATE)
    policy.set_training_mode(True)
    with torch.no_grad():
        policy.value_net.bias.fill_(float(returns.mean()))  # far from where it would begin
    error = 0.0
    for epoch in range(EPOCHS):
        for group in optimiser.param_groups:
            group["lr"] = LEARNING_RATE * (1.0 - epoch / EPOCHS)
        errors = []
        for rows in torch.randperm(len(returns), generator=generator).split(BATCH):
            chosen = policy.get_distribution(observations[rows]).distribution
            assert isinstance(chosen, Normal)
            value = policy.predict_values(observations[rows])[:, 0]
            off = mse_loss(chosen.mean, actions[rows])
            loss = off + VALUE_SHARE * mse_loss(value / scale, returns[rows] / scale)
            optimiser.zero_grad()
            loss.backward()  # type: ignore[no-untyped-call]
            optimiser.step()
            errors.append(float(off.detach()))
        error = float(np.sqrt(np.mean(errors)))
    with torch.no_grad():
        policy.log_std.fill_(LOG_STD)
    return error
