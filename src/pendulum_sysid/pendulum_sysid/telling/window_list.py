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


def list_largest(rows: Sequence[WindowRow]) -> list[WindowRow]:
    """Return the rows that a table shows, in order of time: those with the largest errors."""
    largest = np.argsort(-_compare_windows(rows), kind="stable")[:MOST_LISTED]
    return [rows[k] for k in sorted(largest.tolist(), key=lambda k: rows[k].number)]


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
    """Return the held-out window with the largest error after."""
    held_out = [row for row in rows if row.purpose == HELD_OUT]
    return held_out[int(np.argmax(_compare_windows(held_out)))] if held_out else None


def _compare_windows(rows: Sequence[WindowRow]) -> Floats:
    """Return the error after of each window, (windows,), of the channel that is worse.

    Each channel counts in units of its median error, over the windows in which it is finite: a
    run that diverged is worse than all others, and changes no unit.
    """
    if not rows:
        return np.empty(0)
    errors = np.array([row.after for row in rows])
    finite = np.isfinite(errors)
    usual = [
        np.median(e[kept]) if kept.any() else 1.0
        for e, kept in zip(errors.T, finite.T, strict=True)
    ]
    with np.errstate(over="ignore"):
        return (np.where(finite, errors, np.inf) / np.maximum(usual, 1e-300)).max(axis=1)
