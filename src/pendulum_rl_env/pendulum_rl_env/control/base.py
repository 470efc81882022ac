"""The controller that a learned correction is added to, as numbers that a file can hold."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from typing import Any

import numpy as np

from pendulum_rl_env.control.classical import Tuning, make_plant
from pendulum_rl_env.control.planned import Plan, Planned, design_planned
from pendulum_rl_env.control.swing_up import SwingUp
from pendulum_rl_env.task import Task
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, parse_twin
from pendulum_twin.rig import check_number

MOST_PLANNED = 10_000  # commands
STEP_RANGE_S = (0.001, 1.0)  # s, of `Task`
WEIGHTS = 5  # of a tuning
PAST_COMMANDS = 100  # that a plan's feedback may hold


@dataclass(frozen=True)
class Base:
    """Hold a designed controller.

    twin: that it was designed for.
    step_s: s; from command to command.
    tuning, plan: see `Planned`.
    """

    twin: Twin
    step_s: float
    tuning: Tuning
    plan: Plan | None

    @property
    def task(self) -> Task:
        """Return the task that it was designed for."""
        return Task.make_for_step(self.step_s).allow_commands(self.twin.rig)

    def make_controllers(self, count: int) -> list[Planned]:
        """Return controllers of so many pendulums, which share what does not change.

        Raises BadInputError when nothing can balance the twin.
        """
        plant = make_plant(self.twin, self.task)
        return [Planned(plant, self.tuning, self.plan) for _ in range(count)]

    def to_mapping(self) -> dict[str, Any]:
        """Return the controller as JSON holds it."""
        plan = self.plan and {f.name: getattr(self.plan, f.name).tolist() for f in fields(Plan)}
        return {
            "twin": self.twin.to_mapping(),
            "step_s": self.step_s,
            "tuning": asdict(self.tuning),
            "plan": plan,
        }


def design_base(twin: Twin, task: Task) -> Base:
    """Return the best controller found for a twin; raise BadInputError when there is none."""
    planned = design_planned(twin, task)
    return Base(twin, task.step_s, planned.tuning, planned.plan)


def parse_base(mapping: Mapping[str, Any]) -> Base:
    """Return the controller that a mapping holds.

    Raises BadInputError, KeyError, TypeError or ValueError for a mapping that holds none.
    """
    tuning = dict(mapping["tuning"])
    swing = {key: _check_number(value) for key, value in tuning.pop("swing").items()}
    weights = _check_array(tuning.pop("weights"), (WEIGHTS,))
    numbers = {key: _check_number(value) for key, value in tuning.items()}
    return Base(
        parse_twin(mapping["twin"]),
        check_number("step_s", mapping["step_s"], *STEP_RANGE_S),
        Tuning(weights=tuple(weights.tolist()), swing=SwingUp(**swing), **numbers),
        None if mapping["plan"] is None else _parse_plan(mapping["plan"]),
    )


def _parse_plan(mapping: Mapping[str, Any]) -> Plan:
    n = len(mapping["commands"])
    if not 0 < n <= MOST_PLANNED:
        raise BadInputError(f"plan: expected 1 to {MOST_PLANNED} commands, found {n}")
    width = len(mapping["gains"][0])
    if not 4 <= width <= 4 + PAST_COMMANDS:
        raise BadInputError(f"plan: expected 4 to {4 + PAST_COMMANDS} gains, found {width}")
    return Plan(
        _check_array(mapping["commands"], (n,)),
        _check_array(mapping["states"], (n, 4)),
        _check_array(mapping["gains"], (n, width)),
    )


def _check_array(values: object, shape: tuple[int, ...]) -> Floats:
    """Return finite numbers of a shape; raise BadInputError for others."""
    array = np.array(values, dtype=np.float64)
    if array.shape != shape or not np.isfinite(array).all():
        raise BadInputError(f"expected finite numbers of shape {shape}, found {array.shape}")
    return array


def _check_number(value: object) -> float:
    """Return a finite number; raise BadInputError for anything else."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise BadInputError(f"expected a finite number, found {value!r}")
    return float(value)
