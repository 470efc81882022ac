"""Compare the commands of a recording with those that the driver sent, where both are there.

A driver limits commands, and sends them at its own times. A recording of the commands that were
chosen then says something else than what drove the cart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pendulum_sysid import decisions
from pendulum_twin.arrays import Floats, Ints, Mask
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
    before, slash, _ = command_topic.rpartition("/")
    return before + slash + APPLIED_PWM


def find_differences(
    stamps: Floats, read: tuple[Floats, Floats], sent: tuple[Floats, Floats]
) -> Mask:
    """Return at which samples (n,) the command differs from the command that was sent.

    stamps: (n,) s, of samples.
    read, sent: when commands came, (m,), s, and their values.

    A command is sent after it is chosen, and a sample may come between: what was sent is the same
    if it lies between the least and the greatest command that was in force within
    `COMMAND_CROSSING_S` of the sample.
    """
    near_s = decisions.COMMAND_CROSSING_S
    there = stamps >= max(read[0][0], sent[0][0])
    value = sent[1][_find_last(stamps, sent[0])]
    first, last = _find_last(stamps - near_s, read[0]), _find_last(stamps + near_s, read[0])
    low, high = (
        reduce.reduceat(np.append(read[1], read[1][-1]), np.ravel([first, last + 1], "F"))[::2]
        for reduce in (np.minimum, np.maximum)
    )
    apart = np.maximum(value - high, low - value)
    differ: Mask = there & (apart > decisions.COMMAND_DIFFERS)
    return differ


def _find_last(stamps: Floats, times: Floats) -> Ints:
    """Return the number of the last of commands at times (m,) before each stamp (n,)."""
    return np.maximum(np.searchsorted(times, stamps, side="right") - 1, 0)
