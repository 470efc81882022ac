"""All windows of a diagnosis in order of time: their purpose and their errors before and after."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_sysid.records import Overlay
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.arrays import Floats

LEARNED, HELD_OUT = "learned on", "held out"
MOST_LISTED = 200  # rows of a table


@dataclass(frozen=True)
class WindowRow:
    """Hold a window and where its runs are found.

    number: in order of time, from 1.
    purpose: "learned on" (fit and choice used it) or "held out" (it judges).
    begin_s, end_s: s from the start of the recording.
    before, after: root mean square error of each channel, m or rad.
    index: of the window among those of its purpose.
    """

    number: int
    purpose: str
    begin_s: float
    end_s: float
    before: tuple[float, ...]
    after: tuple[float, ...]
    index: int


def list_windows(verdict: Verdict) -> tuple[WindowRow, ...]:
    """Return all windows whose runs the verdict holds, in order of time."""
    learned = verdict.drawings.learned if verdict.drawings is not None else ()
    rows = []
    for purpose, overlays in ((LEARNED, learned), (HELD_OUT, verdict.overlays)):
        if not overlays or not np.size(overlays[0].times_s):
            continue
        times = overlays[0].times_s
        before, after = (compute_errors(overlays, key) for key in ("before", "after"))
        rows += [
            WindowRow(
                0, purpose, float(times[k, 0]), float(times[k, -1]),
                tuple(before[k].tolist()), tuple(after[k].tolist()), k,
            )
            for k in range(len(times))
        ]  # fmt: skip
    rows.sort(key=lambda row: row.begin_s)
    return tuple(replace(row, number=number) for number, row in enumerate(rows, start=1))


def list_largest(rows: Sequence[WindowRow], most: int = MOST_LISTED) -> list[WindowRow]:
    """Return the rows that a table shows, in order of time: those with the largest errors."""
    usual = np.maximum(np.median([row.after for row in rows], axis=0), 1e-300) if rows else 1.0
    ranked = sorted(rows, key=lambda row: -float(np.max(np.nan_to_num(row.after) / usual)))
    return sorted(ranked[:most], key=lambda row: row.number)


def compute_errors(overlays: Sequence[Overlay], run: str) -> Floats:
    """Return the root mean square error of each window and channel, (windows, channels).

    run: "before" or "after".
    """
    errors = [compute_rmse(getattr(overlay, run), overlay.measured) for overlay in overlays]
    return np.stack(errors, axis=-1)


def compute_rmse(run: Floats, measured: Floats) -> Floats:
    """Return the root mean square of run minus measurement over the samples that are there.

    run, measured: (windows, samples) m or rad; NaN in `measured` for a sample that is missing.

    The errors are (windows,); that of a run that diverged is no finite number.
    """
    valid = ~np.isnan(measured)
    with np.errstate(over="ignore", invalid="ignore"):
        squares = np.where(valid, np.square(run - measured), 0.0).sum(axis=-1)
    return np.asarray(np.sqrt(squares / np.maximum(valid.sum(axis=-1), 1)))


def find_worst(rows: Sequence[WindowRow]) -> WindowRow | None:
    """Return the held-out window with the largest error after.

    Channels are made comparable by the median error of each over the held-out windows.
    """
    held_out = [row for row in rows if row.purpose == HELD_OUT]
    if not held_out:
        return None
    after = np.array([row.after for row in held_out])
    after = np.where(np.isfinite(after), after, np.inf)
    usual = np.maximum(np.median(after, axis=0), 1e-300)
    with np.errstate(invalid="ignore"):
        worst = np.nan_to_num(after / usual, nan=1.0, posinf=np.inf).max(axis=1)
    return held_out[int(np.argmax(worst))]
