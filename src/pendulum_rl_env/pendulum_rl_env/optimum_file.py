"""Read the optimum that `studies.optimum` has written, to give rewards as a share of it."""

from __future__ import annotations

import math
from pathlib import Path

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object

SCHEMA = "pendulum_optimum/1"


def read_best_reward(path: Path, steps: int) -> float:
    """Return the best reward in an optimum's file.

    steps: of an episode to compare with.

    Raises BadInputError when the file is none, or is about episodes of another length.
    """
    content = read_json_object(path, SCHEMA, "an optimum")
    reward, its_steps = content.get("reward"), content.get("steps")
    if not isinstance(reward, int | float) or not math.isfinite(reward) or reward <= 0:
        raise BadInputError(f"{path}: expected a positive reward, found {reward!r}")
    if its_steps != steps:
        raise BadInputError(
            f"{path}: expected the optimum of episodes of {steps} steps, found {its_steps!r}: "
            "give --step-s to both commands"
        )
    return float(reward)
