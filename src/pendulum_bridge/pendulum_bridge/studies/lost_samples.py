"""How many samples of an emulated rig a busy computer has lost: such a recording says little."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pendulum_sysid.cleaning.clock import estimate_rate
from pendulum_sysid.reading.bag import read_bag
from pendulum_twin.arrays import Floats
from pendulum_twin.errors import RigError
from pendulum_twin.standstill import describe_standstill

# Of a minute at 100 Hz: with 1 % lost the demo was right, with 16 % the rig was not known again.
BUSY_SHARE = 0.05


class SamplesLostError(RigError):
    """So many samples are missing that the recording shows the computer more than the rig."""


def check_samples(recording: Path) -> None:
    """Raise SamplesLostError when a computer was too busy to record an emulated rig."""
    stamps_s = read_bag(recording).state_stamp_s
    share = compute_lost_share(stamps_s)
    if share > BUSY_SHARE:
        longest_s = float(np.max(np.diff(stamps_s)))
        raise SamplesLostError(
            f"{100 * share:.0f} % of the emulated rig's samples were lost, for "
            f"{describe_standstill(longest_s)} and is busy"
        )


def compute_lost_share(stamps_s: Floats) -> float:
    """Return the share of samples that never came, 0 to 1, by the stamps (s) of the others.

    A sample that came late, with others close behind it, is not lost.
    """
    if len(stamps_s) < 2:
        return 0.0
    periods = np.ptp(stamps_s) / estimate_rate(stamps_s).period_s
    lost = max(round(float(periods)) + 1 - len(stamps_s), 0)
    return lost / (lost + len(stamps_s))
