"""Compare the commands of a recording with those that the driver sent, where both are there.

A driver limits commands, and sends them at its own times. A recording of the commands that were
chosen then says something else than what drove the cart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.topics import APPLIED_PWM


@dataclass(frozen=True)
class SentCommands:
    """Say where a recording holds other commands than the driver sent.

    read, sent: topics of the commands that are read, and of those that the driver sent.
    differ: (n,) at which samples they differ.
    """

    read: str
    sent: str
    differ: Mask

    @property
    def note(self) -> str:
        """Return a sentence that says what differs and what to do."""
        return (
            f"the driver sent other commands ({self.sent}) than {self.read} holds in "
            f"{np.mean(self.differ):.0%} of the samples: use --command-topic {self.sent}"
        )


def name_sent_topic(command_topic: str) -> str:
    """Return the topic on which the driver of a topic of commands says what it sent."""
    return f"{command_topic.rpartition('/')[0]}/{APPLIED_PWM}"


def find_differences(
    stamps: Floats, read: tuple[Floats, Floats], sent: tuple[Floats, Floats]
) -> Mask:
    """Return at which samples (n,) the command differs from the command that was sent.

    stamps: (n,) s, of samples.
    read, sent: when commands came, (m,), s, and their values.

    A command is sent after it is chosen, and a sample may come between: what was sent is the same
    if it lies within the commands of a sample period before and after.
    """
    period_s = float(np.median(np.diff(stamps)))
    there = stamps >= max(read[0][0], sent[0][0])
    near = [_hold(stamps + shift, *read) for shift in (-period_s, 0.0, period_s)]
    value = _hold(stamps, *sent)
    apart = np.maximum(value - np.max(near, axis=0), np.min(near, axis=0) - value)
    differ: Mask = there & (apart > decisions.COMMAND_DIFFERS)
    return differ


def _hold(stamps: Floats, times: Floats, command: Floats) -> Floats:
    return command[np.maximum(np.searchsorted(times, stamps, side="right") - 1, 0)]
