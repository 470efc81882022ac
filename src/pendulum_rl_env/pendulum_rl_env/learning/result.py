"""The figures of a training, as `result.json` holds them."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path

from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object, write_atomically

SOLVED_MEAN_REWARD = 400.0  # of an evaluation; the thesis: training may end above it
SCHEMA = "pendulum_training/1"


@dataclass
class Result:
    """Hold what is known of a training so far; wall times count from the start of the program.

    environment: its id; of a rig that of the environment over topics.
    preset, algorithm, seed: as chosen.
    timesteps: done so far.
    steps_to_400, wall_to_400_s: at the first evaluation with a mean of at least 400; None before.
    best_mean_reward: of all evaluations; None before the first.
    steps_per_s: of the learning alone.
    wall_s: s; of the whole program.
    interrupted: whether Ctrl-C ended it.
    evaluations: steps, wall_s and mean_reward of each.
    """

    environment: str
    preset: str
    algorithm: str
    seed: int
    timesteps: int = 0
    steps_to_400: int | None = None
    wall_to_400_s: float | None = None
    best_mean_reward: float | None = None
    steps_per_s: float = 0.0
    wall_s: float = 0.0
    interrupted: bool = False
    evaluations: list[dict[str, float]] = field(default_factory=list)
    schema: str = SCHEMA

    def note(self, steps: int, wall_s: float, mean: float) -> bool:
        """Add an evaluation; return whether it is the best so far."""
        self.evaluations.append({"steps": steps, "wall_s": round(wall_s, 3), "mean_reward": mean})
        if mean >= SOLVED_MEAN_REWARD and self.steps_to_400 is None:
            self.steps_to_400, self.wall_to_400_s = steps, round(wall_s, 3)
        if self.best_mean_reward is None or mean > self.best_mean_reward:
            self.best_mean_reward = mean
            return True
        return False

    def go_on(self, path: Path) -> None:
        """Take over the evaluations of an earlier run of the training, if its file is there.

        Raises BadInputError when the file is no result of a training.
        """
        if not path.exists():
            return
        earlier = read_json_object(path, SCHEMA, "a training's result")
        try:
            for row in earlier["evaluations"]:
                self.note(int(row["steps"]), float(row["wall_s"]), float(row["mean_reward"]))
        except (KeyError, TypeError, ValueError) as error:
            raise BadInputError(
                f"{path}: expected evaluations with steps, wall_s and mean_reward, found "
                f"{error!r} missing or odd: remove the file to go on without them"
            ) from error

    def save(self, path: Path) -> None:
        """Write the result as JSON, whole or not at all."""
        write_atomically(path, json.dumps(asdict(self), indent=2) + "\n")
