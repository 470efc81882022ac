"""Compare the commands of a policy with those that a rig takes, before the first is sent."""

from __future__ import annotations

import math
import sys

from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import LARGEST_PWM


def check_limits(policy_limit: float, rig_limit: float | None, rig: str) -> None:
    """Print on stderr that the rig clips the policy's commands, where it takes smaller ones.

    policy_limit: largest command of the policy, in the unit of the rig that it was trained for.
    rig_limit: largest command that the rig takes; None or infinite where that is not known.
    rig: its name.

    Raises BadInputError when one limit is of a PWM fraction and the other is not.
    """
    if rig_limit is None or math.isinf(rig_limit):
        return
    if (policy_limit > LARGEST_PWM) != (rig_limit > LARGEST_PWM):
        raise BadInputError(
            f"{rig}: expected a rig that takes commands up to {policy_limit:g}, found one that "
            f"takes up to {rig_limit:g}: one is a PWM fraction and the other is not (volts, say), "
            "so the policy's commands would mean something else here: train in a twin of this "
            "rig, or correct the pwm_limit of twin file or driver"
        )
    if rig_limit < policy_limit:
        print(
            f"pendulum_rl_env: {rig} takes commands up to {rig_limit:g}: larger commands of the "
            f"policy, up to {policy_limit:g}, are clipped",
            file=sys.stderr,
            flush=True,
        )
