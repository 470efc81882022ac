"""Leave out of the search over the long horizon what a few instants have spoiled.

Over a second, an error that a single wrong command leaves adds up until it is all that a fit of
least squares sees, and the constants bend to it. An effect that frees them again then helps in all
other windows, whatever it is. A law acts in every window that visits it, and acts over the short
horizon too.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.records import Fit, Windows
from pendulum_twin.arrays import Floats, Mask


def find_spoiled(fit: Fit) -> Mask:
    """Return which whole windows are far off, (windows,); none where they are not few.

    fit: over the long horizon, a row for each whole window.
    """
    power = np.sum(fit.window_squares / fit.noise**2, axis=1) / fit.counts.sum(axis=1).clip(1.0)
    far = power > decisions.EVENT_FLOORS**2 * np.median(power)
    is_few = far.sum() <= decisions.MOST_EVENTS and far.mean() <= decisions.EVENT_MOST_SHARE
    return np.asarray(far if is_few else np.zeros_like(far))


def leave_windows_out(search: Search, spoiled: Mask) -> Search:
    """Return the search without some of the windows that it learns from.

    spoiled: (windows,) of `Split.learn`.
    """
    split = search.split
    out = split.learn.begin[spoiled]

    def keep(windows: Windows) -> Windows:
        return windows.pick(~np.isin(windows.begin, out))

    return replace(
        search, split=replace(split, train=keep(split.train), choose=keep(split.choose))
    )


def pick_windows(fit: Fit, kept: Mask) -> Fit:
    """Return a fit with the start states and the errors of some windows; nothing is fitted anew.

    kept: (windows,) of whole windows.
    """
    rows = np.repeat(kept, fit.pieces)

    def pick(values: Floats) -> Floats:
        return np.asarray(values[rows])

    return replace(
        fit,
        start_states=pick(fit.start_states),
        window_squares=pick(fit.window_squares),
        counts=pick(fit.counts),
    )
