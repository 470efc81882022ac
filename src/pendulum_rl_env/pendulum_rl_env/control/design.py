"""Design a classical controller for a twin by the reward that it earns there.

First the swing-up is chosen, then each number in turn. A twin is never quite the rig, so
candidates also run on perturbed twins, with encoders as coarse as a rig's. Nothing is random: the
same twin gives the same controller.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product
from typing import Any, Protocol

from pendulum_rl_env.control.classical import Classical, Plant, Tuning, make_plant
from pendulum_rl_env.control.swing_up import SwingUp
from pendulum_rl_env.kernel_transport import KernelTransport
from pendulum_rl_env.reward import compute_reward_and_end
from pendulum_rl_env.task import Task
from pendulum_rl_env.transport import Transport
from pendulum_twin.arrays import Floats
from pendulum_twin.encoders import Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin

TYPICAL_ENCODERS = Encoders(57e-6, 2 * math.pi / 4096)  # of the INTECO rig, m and rad a step
PERTURBATIONS = (  # factor of the drive's force, factor of the pole's inertia, rad off hanging
    (1.0, 1.0, 0.0),
    (1.05, 0.97, 0.04),
    (0.95, 1.03, -0.04),
    (1.05, 1.03, -0.08),
    (0.95, 0.97, 0.08),
)
FINALISTS = 6  # swing-ups that are tried on all perturbed rigs
ROUNDS = 2  # through all numbers

Change = Callable[[Tuning], Tuning]


class Controller(Protocol):
    """Give a PWM fraction for a measured state, once a period; `reset` before each episode."""

    def reset(self) -> None:
        """Begin an episode."""
        ...

    def __call__(self, measured: Floats) -> float:
        """Return the PWM fraction to hold until the next sample; measured: (4,) x, th, v, w."""
        ...


def design_controller(twin: Twin, task: Task) -> Classical:
    """Return the best controller found; raise BadInputError when the twin cannot be balanced."""
    plant = make_plant(twin, task)
    rigs = [make_perturbed_rig(plant.twin, task, *changes) for changes in PERTURBATIONS]
    swings = {
        tuning: _rate_tuning(plant, tuning, rigs[:1])
        for tuning in (Tuning(swing=swing) for swing in _list_swing_ups())
    }
    finalists = sorted(swings, key=lambda tuning: -swings[tuning])[:FINALISTS]
    ratings = {tuning: _rate_tuning(plant, tuning, rigs) for tuning in finalists}
    for _ in range(ROUNDS):
        for changes in _list_changes():
            best = max(ratings, key=lambda tuning: ratings[tuning])
            for tuning in (change(best) for change in changes):
                if tuning not in ratings:
                    ratings[tuning] = _rate_tuning(plant, tuning, rigs)
    return Classical(plant, max(ratings, key=lambda tuning: ratings[tuning]))


def run_controller(rig: Transport, controller: Controller, task: Task) -> float:
    """Run one episode from hanging at rest and return its sum of rewards."""
    controller.reset()
    state, total = rig.reset().state, 0.0
    for _ in range(task.steps):
        state = rig.exchange(controller(state)).state
        reward, end = compute_reward_and_end(*state.tolist(), task.limits, task.penalties)
        total += reward
        if end:
            break
    return total


def _rate_tuning(plant: Plant, tuning: Tuning, rigs: Sequence[Transport]) -> float:
    """Return half the mean and half the minimum of the rewards on the rigs."""
    try:
        controller = Classical(plant, tuning)
    except BadInputError:
        return -math.inf
    return rate_controller(controller, rigs, plant.task)


def rate_controller(controller: Controller, rigs: Sequence[Transport], task: Task) -> float:
    """Return half the mean and half the minimum of the rewards on the rigs."""
    rewards = [run_controller(rig, controller, task) for rig in rigs]
    return 0.5 * (sum(rewards) / len(rewards) + min(rewards))


def make_perturbed_rig(
    twin: Twin, task: Task, force: float, inertia: float, aside_rad: float
) -> KernelTransport:
    """Return a twin with coarse encoders that is not quite the twin; see `PERTURBATIONS`."""
    perturbed = perturb_twin(twin, force, inertia)
    return KernelTransport(perturbed, task.step_s, TYPICAL_ENCODERS, aside_rad)


def perturb_twin(twin: Twin, force: float, inertia: float) -> Twin:
    """Return a twin whose drive and pole's inertia are these factors of the twin's."""
    rig = replace(
        twin.rig,
        force_per_pwm_n=(twin.rig.force_per_pwm_n or 0.0) * force,
        pole_inertia_kg_m2=(twin.rig.pole_inertia_kg_m2 or 0.0) * inertia,
    )
    return replace(twin, rig=rig)


def _list_swing_ups() -> Iterator[SwingUp]:
    gains, overs = (2.0, 4.0, 8.0, 16.0), (0.0, 0.04, 0.08)
    pulls, firsts = (1.0, 4.0, 10.0), (1.0, -1.0)
    for gain, over, pull, first in product(gains, overs, pulls, firsts):
        yield SwingUp(gain, over, pull, first)


def _list_changes() -> tuple[list[Change], ...]:
    """Return the candidates for each number that acts after the swing-up."""
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
