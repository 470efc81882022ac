"""How long a command has waited on its way, whatever the clocks of two machines say.

A command's age, from its sending to its arrival, is the time that it waited and the difference of
two clocks. The youngest of the last commands had hardly waited; so a command has waited for as
long as it is older than that. After a clock was set, at most REMEMBERED commands are misjudged.
"""

from __future__ import annotations

import math

REMEMBERED = 10  # commands
# a command that comes so much sooner than ten others was sent by a clock that was set: no computer
# that can drive a rig is ten times in a row a second late
SET_BACK_S = 1.0


def remember_age(age_s: float, ages_s: tuple[float, ...]) -> tuple[float, ...]:
    """Return the ages of the last commands with that of another one, s."""
    return (*ages_s, age_s)[-REMEMBERED:]


def estimate_wait_s(age_s: float, ages_s: tuple[float, ...]) -> float:
    """Return how long a command has waited, s; infinity when a clock was set back.

    age_s: s; of the command.
    ages_s: s; of the commands before it. Without any, both clocks count as the same.
    """
    waited_s = age_s - min(ages_s, default=0.0)
    return waited_s if waited_s > -SET_BACK_S else math.inf
