"""Record a rig that is driven by a plan or a controller, and keep what it showed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from pendulum_bridge.emulator.stale_start import compute_stale_command
from pendulum_bridge.recording.bag_writer import Log
from pendulum_twin.plans.excitation import Excitation, compute_command, find_command_direction

Floats = NDArray[np.float64]
Driver = Callable[
    [Floats], float
]  # the sample x, th, v, w -> the command (PWM fraction) that is held to the next

FIRST_STAMP_NS = 10**9  # the emulated clock's; the same run gives the same file
JOINTS = ("cart", "pole")


class Driven(Protocol):
    """What is recorded: an `EmulatedRig`, or one that is watched."""

    @property
    def period_s(self) -> float:
        """Return the time from sample to sample, s."""

    @property
    def stale_samples(self) -> int:
        """Return how many of the first samples belong to no run."""

    @property
    def sample(self) -> Floats:
        """Return the last sample, shape (4,)."""

    def step(self, command: float) -> Floats:
        """Hold a command for one period."""


def record_rig(rig: Driven, driver: Driver, count: int) -> Log:
    """Return `count` samples and the commands that the driver answered; of stale samples it sees none."""
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
    """Return samples and commands of a plan; stale samples at its beginning push its end out of the recording.

    Which way a command moves the cart is seen from the first push, and centring begins only then.
    """
    return record_rig(rig, make_plan_driver(plan), len(plan.commands))


def make_plan_driver(plan: Excitation) -> Driver:
    """Return a driver that plays the plan, sample by sample, and keeps the cart on the rail as a plan is kept on it."""
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
