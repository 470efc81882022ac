"""Cut a recording into windows, and the windows into three parts that are kept apart.

Each window goes to one part, interleaved through the recording, so that every part sees every
regime of the recording. A window begins with the last sample of the window before: neighbouring
windows share this sample and no other. The pattern begins one place further on in every stretch,
lest repeated runs give each part the same moments of them. The parts "train" and "choose" together
are the learning windows, on which every fit is made and cross-validated.
"""

from __future__ import annotations

import numpy as np

from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.records import Split
from pendulum_twin.signals import Signals

PATTERN = ("train", "choose", "train", "held_out")


def split_windows(signals: Signals, state: SmoothState) -> Split:
    """Return windows to fit on (half), to choose on and to judge on (a quarter each).

    Raises UnusableRecording when the recording is too short for at least one window in each.
    """
    windows = cut_windows(signals, state, WINDOW_S)
    if len(windows) < len(PATTERN):
        raise UnusableRecording(
            f"expected at least {len(PATTERN)} usable windows of {WINDOW_S:g} s to fit, choose "
            "and judge on, "
            f"found {len(windows)}: record longer"
        )
    stretch = np.searchsorted(signals.stretch_begins, windows.begin, side="right") - 1
    part = (np.arange(len(windows)) - np.searchsorted(stretch, stretch) + stretch) % len(PATTERN)
    windows_split = Split(
        *(
            windows.pick(np.isin(part, _list_places(name)))
            for name in ("train", "choose", "held_out")
        )
    )
    if not (
        len(windows_split.train) and len(windows_split.choose) and len(windows_split.held_out)
    ):
        raise UnusableRecording(
            "expected windows to fit, choose and judge on, found one of these parts empty: record "
            "longer"
        )
    return windows_split


def _list_places(name: str) -> list[int]:
    return [k for k, part_name in enumerate(PATTERN) if part_name == name]
