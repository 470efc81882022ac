"""Whether the first push of a plan was sent evenly enough to show the direction of the cart.

A busy machine sends late: the command before acts on meanwhile. A push whose first half was cut
short moves the cart the other way, and the centring that follows would push the cart off the rail.
So the push is judged as it was sent, by the clock of its sender: how far it moves a free cart of
unit acceleration per unit of command.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_twin.plans.excitation import Excitation

LEAST_SHARE = 0.5  # of the travel that the plan means: half is lost by a delay of 35 ms
MOST_PUSHES = 8  # after which the plan is given up


@dataclass(frozen=True)
class Push:
    """Hold what has been sent of a push.

    began: s; the sender's clock and the sample's stamp at the first command; None before it.
    seconds: s; from the first command to the last.
    command: PWM fraction; the last command.
    speed: PWM s; of the free cart.
    travel: PWM s^2; of the free cart.
    """

    began: tuple[float, float] | None = None
    seconds: float = 0.0
    command: float = 0.0
    speed: float = 0.0
    travel: float = 0.0


def send_push(command: float, now_s: float, stamp_s: float, push: Push) -> Push:
    """Return the push after a command.

    command: PWM fraction.
    now_s: s, monotonic; when it was sent.
    stamp_s: s; of the sample that it answers: the time that counts for a rig in process, which
        runs faster than time.
    """
    if push.began is None:
        return Push((now_s, stamp_s), command=command)
    sender_s, rig_s = push.began
    seconds = max(push.seconds, now_s - sender_s, stamp_s - rig_s)
    step_s = seconds - push.seconds
    return Push(
        push.began,
        seconds,
        command,
        push.speed + push.command * step_s,
        push.travel + (push.speed + push.command * step_s / 2) * step_s,
    )


def is_even(push: Push, plan: Excitation) -> bool:
    """Tell whether the push, as sent, shows the direction that the plan's push shows."""
    speed = np.cumsum(plan.commands[: plan.push_ends]) / plan.rate_hz
    return bool(push.travel >= LEAST_SHARE * np.sum(speed) / plan.rate_hz)
