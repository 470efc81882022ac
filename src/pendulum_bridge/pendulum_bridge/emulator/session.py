"""Play an excitation on an emulated rig and keep what it showed."""

from __future__ import annotations

import numpy as np

from pendulum_bridge.bag_writer import Log
from pendulum_bridge.emulator.rig import EmulatedRig
from pendulum_twin.plans.excitation import Excitation, next_command, way_of

FIRST_STAMP_NS = 10**9  # the emulated clock's; the same run gives the same file
JOINTS = ("cart", "pole")


def play(rig: EmulatedRig, plan: Excitation) -> Log:
    """Return samples and commands of the whole plan: each command is chosen from its sample and held to the next.

    Which way a command moves the cart is seen from the first push, and centring begins only then.
    """
    count = len(plan.commands)
    samples, commands = np.empty((count, 4)), np.empty(count)
    way = 0
    for k in range(count):
        samples[k] = rig.sample
        if k == plan.push_ends:
            way = way_of(samples[k, 0] - samples[0, 0])
        commands[k] = next_command(plan, k, samples[k, 0], samples[k, 2], way)
        rig.step(commands[k])
    stamps = FIRST_STAMP_NS + np.round(np.arange(count) * rig.period_s * 1e9).astype(np.int64)
    return Log(stamps, JOINTS, samples[:, :2], samples[:, 2:], commands)
