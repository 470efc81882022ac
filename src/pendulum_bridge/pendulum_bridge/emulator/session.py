"""Record a rig that a plan or a controller drives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np

from pendulum_bridge.emulator.stale_start import compute_stale_command
from pendulum_bridge.recording.bag_writer import Log
from pendulum_twin.arrays import Floats
from pendulum_twin.plans.excitation import Excitation, compute_command, find_command_direction

# From the sample x, th, v, w to the command (PWM fraction) that is held to the next sample.
Driver = Callable[[Floats], float]

FIRST_STAMP_NS = 10**9  # of the emulated clock, so that the same run gives the same file
JOINTS = ("cart", "pole")


class Driven(Protocol):
    """A rig that can be recorded, such as `EmulatedRig`."""

    @property
    def period_s(self) -> float:
        """Return the time from sample to sample, s."""

    @property
    def stale_samples(self) -> int:
        """Return how many of the first samples are stale: no command acts on them."""

    @property
    def sample(self) -> Floats:
        """Return the last sample, shape (4,)."""

    def step(self, command: float) -> Floats:
        """Hold a command for one period."""


def record_rig(rig: Driven, driver: Driver, count: int) -> Log:
    """Return `count` samples and the driver's commands; the driver sees no stale sample."""
    samples, commands = np.empty((count, 4)), np.empty(count)
    for k in range(count):
        samples[k] = rig.sample
        commands[k] = (
            driver(rig.sample)
            if k >= rig.stale_samples
            else compute_stale_command(k * rig.period_s)
        )
        rig.step(commands[k])
    stamps = FIRST_STAMP_NS + np.round(np.arange(count) * rig.period_s * 1e9).astype(np.int64)
    return Log(stamps, JOINTS, samples[:, :2], samples[:, 2:], commands)


def play_plan(rig: Driven, plan: Excitation) -> Log:
    """Return samples and commands of a plan.

    The driver sees from the first push which way a command moves the cart; it centres the cart
    only after it. Stale samples at the beginning push the plan's end out of the recording.
    """
    return record_rig(rig, make_plan_driver(plan), len(plan.commands))


def make_plan_driver(plan: Excitation) -> Driver:
    """Return a driver that plays the plan sample by sample and centres the cart."""
    k, way, first_m = 0, 0, 0.0

    def command(sample: Floats) -> float:
        nonlocal k, way, first_m
        if k == 0:
            first_m = sample[0]
        if k == plan.push_ends:
            way = find_command_direction(sample[0] - first_m)
        chosen = compute_command(plan, k, sample[0], sample[2], way)
        k += 1
        return chosen

    return command
