"""Leave out what neither a twin nor the recorded commands explain, where commands are in doubt.

A busy computer may stamp a command several samples late, or lose what drove the cart for a while.
Where a twin follows nearly all windows at the noise and a few are off by many times as much, other
commands acted there, or something pushed the cart: a law of the rig shows again and again.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.leaving_out import leave_samples_out
from pendulum_sysid.fitting.acting_commands import follow_windows
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.records import QualityFinding, Windows
from pendulum_twin.arrays import Floats, Mask

NOTE = (
    "the twin follows all other windows, and is far off here: other commands than the recorded "
    "ones moved the cart, or something pushed it; left out"
)


def leave_out_unexplained(case: Case, theta: Floats) -> Case:
    """Return the case without the windows that are far off; the case itself if there are none.

    Nothing is left out of a recording whose commands are not in doubt, beside a twin that lacks
    physics in typical windows, and where more windows are far off than a computer loses.

    theta: (SIZE,) of a twin, fitted to typical windows.
    """
    windows = cut_windows(case.signals, case.state, WINDOW_S / 2)
    if case.recording.doubt is None or case.signals.parts is not None or not len(windows):
        return case
    seen = follow_windows(case, theta, windows)
    far = seen.power > decisions.COMMAND_MOST_TYPICAL
    if seen.typical > decisions.COMMAND_TYPICAL_AT_NOISE or not far.any():
        return case
    if np.mean(far) > decisions.COMMAND_MOST_UNEXPLAINED:
        return case
    spans = _join_spans(windows, far)
    period_s = case.signals.period_s
    times = tuple((first * period_s, stop * period_s) for first, stop in spans)
    recording = leave_samples_out(
        case.recording, spans, QualityFinding("gap", len(spans), times, NOTE)
    )
    return replace(case, recording=recording)


def _join_spans(windows: Windows, far: Mask) -> list[tuple[int, int]]:
    """Return first and stop of the samples that the windows cover, neighbours joined."""
    spans = []
    for is_far, group in groupby(range(len(windows)), key=lambda k: bool(far[k])):
        if is_far:
            own = windows.begin[list(group)]
            spans.append((int(own[0]), int(own[-1]) + windows.samples))
    return spans
