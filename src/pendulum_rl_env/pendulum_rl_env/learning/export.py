"""Write a policy as one ONNX file that needs nothing else: measured state in, PWM out."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from torch import Tensor, nn

from pendulum_rl_env.learning.correcting_policy import CorrectingPolicy
from pendulum_rl_env.task import Task
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import write_atomically

INPUT, OUTPUT = "state", "pwm"


class StateToPwm(nn.Module):
    """Turn measured states (n, 4) into PWM fractions (n, 1); the scaling is inside.

    A rig whose command has another unit gets it in that unit.

    A state is x (m), th (rad, 0 upright), v (m/s), w (rad/s).
    """

    def __init__(self, model: BaseAlgorithm, task: Task) -> None:
        super().__init__()
        self._policy = model.policy
        self._limit = task.pwm_limit
        self._bounds = torch.as_tensor(task.bounds)  # a constant of the graph

    def forward(self, state: Tensor) -> Tensor:
        """Return the deterministic action in PWM."""
        x, th, v, w = state[:, 0], state[:, 1], state[:, 2], state[:, 3]
        observation = torch.stack([x, v, torch.sin(th), torch.cos(th), w], dim=1)
        observation = torch.minimum(torch.maximum(observation, -self._bounds), self._bounds)
        action = self._policy._predict(observation, deterministic=True)
        return self._limit * torch.clamp(action, -1.0, 1.0)


def export(model: BaseAlgorithm, task: Task, path: Path) -> None:
    """Write the deterministic policy as ONNX.

    Input "state": float32 (n, 4). Output "pwm": float32 (n, 1).

    Raises BadInputError for another task's policy, or when the file cannot be written.
    """
    if isinstance(model.policy, CorrectingPolicy):
        raise BadInputError(
            "expected a policy whose command is all its own, found a policy that corrects a "
            "controller, which runs the twin itself and is no graph of tensors: use policy.zip"
        )
    if model.observation_space.shape != (5,):
        raise BadInputError(
            f"expected a policy for observations (5,), found {model.observation_space.shape}"
        )
    content = io.BytesIO()
    states = torch.tensor([[0.0, np.pi, 0.0, 0.0]], dtype=torch.float32)
    model.policy.set_training_mode(False)
    torch.onnx.export(
        StateToPwm(model, task).eval(),
        (states,),
        content,  # type: ignore[arg-type]  # a stream serves as well
        input_names=[INPUT],
        output_names=[OUTPUT],
        dynamic_axes={INPUT: {0: "n"}, OUTPUT: {0: "n"}},
        dynamo=False,
    )
    try:
        write_atomically(path, content.getvalue())
    except OSError as error:
        raise BadInputError(
            f"{path}: expected a place for the policy, found {error.strerror}"
        ) from error
