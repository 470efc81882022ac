"""Choose a classical controller for a twin by the reward that it earns there: how it swings up, then each number in turn.

A twin is never quite the rig, so candidates also run on twins that are a little off, measured as
coarsely as a rig measures. Nothing is drawn: the same twin gives the same controller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

from pendulum_rl_env.control.classical import Classical, Plant, Tuning, make_plant
from pendulum_rl_env.control.swing_up import SwingUp
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import Task
from pendulum_rl_env.transport import Transport
from pendulum_twin.encoders import Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TYPICAL_ENCODERS = Encoders(57e-6, 2 * math.pi / 4096)
PERTURBATIONS = (  # times the drive's force, times the pole's inertia, rad aside of hanging
    (1.0, 1.0, 0.0),
    (1.05, 0.97, 0.04),
    (0.95, 1.03, -0.04),
    (1.05, 1.03, -0.08),
    (0.95, 0.97, 0.08),
)
FINALISTS = 6  # ways to swing up that are looked at closer
ROUNDS = 2

Change = Callable[[Tuning], Tuning]


def design_controller(twin: Twin, task: Task) -> Classical:
    """Return the best controller found for a twin; raise BadInputError when the twin cannot be balanced."""
    plant = make_plant(twin, task)
    rigs = [_make_perturbed_rig(plant.twin, task, *how) for how in PERTURBATIONS]
    swings = {Tuning(swing=swing): 0.0 for swing in _list_swing_ups()}
    for tuning in swings:
        swings[tuning] = _rate_tuning(plant, tuning, rigs[:1])
    earned = {
        tuning: _rate_tuning(plant, tuning, rigs)
        for tuning in sorted(swings, key=lambda each: -swings[each])[:FINALISTS]
    }
    for _ in range(ROUNDS):
        for changes in _list_changes():
            best = max(earned, key=lambda each: earned[each])
            for tuning in (change(best) for change in changes):
                if tuning not in earned:
                    earned[tuning] = _rate_tuning(plant, tuning, rigs)
    return Classical(plant, max(earned, key=lambda each: earned[each]))


def run_controller(rig: Transport, controller: Classical, task: Task) -> float:
    """Return the sum of rewards of one episode from hanging at rest."""
    controller.reset()
    state, total = rig.reset().state, 0.0
    for _ in range(task.steps):
        state = rig.exchange(controller(state)).state
        gain, end = compute_reward_and_end(*state.tolist(), task.limits, task.penalties)
        total += gain
        if end:
            break
    return total


def _rate_tuning(plant: Plant, tuning: Tuning, rigs: Sequence[Transport]) -> float:
    """Return what a tuning earns on the rigs: half the mean and half the least."""
    try:
        controller = Classical(plant, tuning)
    except BadInputError:
        return -math.inf
    earned = [run_controller(rig, controller, plant.task) for rig in rigs]
    return 0.5 * (sum(earned) / len(earned) + min(earned))


def _make_perturbed_rig(
    twin: Twin, task: Task, force: float, inertia: float, aside_rad: float
) -> KernelTransport:
    rig = replace(
        twin.rig,
        force_per_pwm_n=(twin.rig.force_per_pwm_n or 0.0) * force,
        pole_inertia_kg_m2=(twin.rig.pole_inertia_kg_m2 or 0.0) * inertia,
    )
    return KernelTransport(
        Twin(twin.name, rig, twin.effects), task.step_s, TYPICAL_ENCODERS, aside_rad
    )


def _list_swing_ups() -> Iterator[SwingUp]:
    """Yield ways to swing up."""
    for gain, over, pull, first in product(
        (2.0, 4.0, 8.0, 16.0), (0.0, 0.04, 0.08), (1.0, 4.0, 10.0), (1.0, -1.0)
    ):
        yield SwingUp(gain, over, pull, first)


def _list_changes() -> tuple[list[Change], ...]:
    """Return what is tried for each number of what follows the swing-up."""
    return (
        [_change_numbers(catch=value) for value in (0.5, 1.0, 2.0)],
        [_change_numbers(effort=value) for value in (3.0, 10.0, 30.0)],
        [_change_weight(0, value) for value in (3.0, 10.0, 30.0)],
        [_change_weight(2, value) for value in (0.1, 0.5, 2.0)],
        [_change_numbers(dry=value) for value in (0.6, 0.9)],
    )


def _change_numbers(**numbers: Any) -> Change:
    return lambda tuning: replace(tuning, **numbers)


def _change_weight(place: int, value: float) -> Change:
    return lambda tuning: replace(
        tuning, weights=(*tuning.weights[:place], value, *tuning.weights[place + 1 :])
    )
