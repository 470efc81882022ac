"""The numbers behind the pictures of a report, for the script that draws them anew to zoom in.

Long arrays are base64 of little-endian numbers: float32 for the recording, int16 with an offset
and a step for the runs over windows. What a page can hold is bounded; a recording that is longer
is thinned to the least and the largest value of each bucket, and windows are spread evenly.
"""

from __future__ import annotations

import base64
import json
from collections.abc import Sequence
from typing import Any

import numpy as np

from pendulum_sysid.records import Overlay
from pendulum_sysid.telling.display import format_unit
from pendulum_sysid.telling.svg import thin_out
from pendulum_sysid.telling.window_list import HELD_OUT, LEARNED, WindowRow, find_worst
from pendulum_sysid.verdict.drawn import Motion
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.arrays import Floats, Ints

MOST_SAMPLES = 16_000  # of the recording, that a page holds of each channel
MOST_WINDOWS = 200  # whose runs a page holds
MOST_POINTS = 126  # of a run over a window
MOST_MARKS = 2_000  # samples left out that are marked
REACH = 3.0  # measured spans, by which a run may leave the measurement and is still drawn
INT16 = 32_000

TRACKS = (  # field of Motion -> title, unit
    ("command", "command", ""),
    ("cart", "cart position", "m"),
    ("cart_velocity", "cart velocity", "m/s"),
    ("pole", "pole angle", "rad"),
    ("pole_rate", "pole rate", "rad/s"),
)

Json = dict[str, Any]


def make_data(verdict: Verdict, rows: Sequence[WindowRow], plots: Sequence[Json]) -> str:
    """Return the data of a page as JSON that can stand in a script element."""
    motion = verdict.drawings.motion if verdict.drawings is not None else None
    data = {
        "motion": encode_motion(motion) if motion is not None else None,
        "windows": encode_windows(verdict, rows),
        "plots": {plot["key"]: plot for plot in plots},
    }
    return json.dumps(data, allow_nan=False, separators=(",", ":")).replace("<", "\\u003c")


def encode_motion(motion: Motion) -> Json:
    """Return the recording: times and tracks of equal length; NaN where nothing was measured."""
    chosen = thin_motion(motion)
    # of a thinned recording all tracks get the first track's times: off by less than a bucket
    times = motion.times_s[chosen] if chosen.ndim == 1 else motion.times_s[chosen[0]]
    tracks = []
    for k, (name, title, unit) in enumerate(list_tracks(motion)):
        at = chosen if chosen.ndim == 1 else chosen[k]
        values = getattr(motion, name)[at]
        tracks.append({"name": name, "title": title, "unit": unit, "values": encode(values)})
    marks = motion.left_out_s[thin_out(len(motion.left_out_s), MOST_MARKS)]
    return {
        "times": encode(times - times[:1], "<f4") if len(times) else "",
        "begin": float(times[0]) if len(times) else 0.0,
        "tracks": tracks,
        "marks": [round(float(mark), 4) for mark in marks],
        "breaks": [[round(a, 4), round(b, 4)] for a, b in motion.breaks_s],
        "thinned": bool(chosen.ndim > 1),
    }


def list_tracks(motion: Motion) -> list[tuple[str, str, str]]:
    """Return field, title and unit of each track that the recording holds."""
    return [track for track in TRACKS if getattr(motion, track[0]) is not None]


def thin_motion(motion: Motion, most: int = MOST_SAMPLES) -> Ints:
    """Return the samples that are drawn, (n,) or (tracks, n).

    A long recording is cut into buckets; of each the least and the largest value of every track is
    drawn, in order of time, so that no peak is lost.
    """
    samples, tracks = len(motion.times_s), list_tracks(motion)
    if samples <= most:
        return np.arange(samples)
    edges = np.linspace(0, samples, most // 2 + 1).astype(np.int64)
    chosen = np.empty((len(tracks), 2 * (len(edges) - 1)), dtype=np.int64)
    for k, (name, _, _) in enumerate(tracks):
        values = getattr(motion, name)
        least = np.where(np.isnan(values), np.inf, values)
        largest = np.where(np.isnan(values), -np.inf, values)
        width = int(np.diff(edges).max())
        bucket = np.minimum(edges[:-1, None] + np.arange(width), edges[1:, None] - 1)
        row = np.arange(len(bucket))
        pair = (
            bucket[row, least[bucket].argmin(axis=1)],
            bucket[row, largest[bucket].argmax(axis=1)],
        )
        chosen[k, 0::2], chosen[k, 1::2] = np.minimum(*pair), np.maximum(*pair)
    return chosen


def encode_windows(verdict: Verdict, rows: Sequence[WindowRow]) -> Json:
    """Return all windows with their errors, and the runs of those that the page holds."""
    learned = verdict.drawings.learned if verdict.drawings is not None else ()
    groups = {LEARNED: learned, HELD_OUT: verdict.overlays}
    channels = next((group for group in groups.values() if group), ())
    kept = choose_windows(rows)
    return {
        "channels": [{"name": o.channel, "unit": format_unit(o.unit)} for o in channels],
        "rows": [
            [
                row.number, int(row.purpose == HELD_OUT), round(row.begin_s, 4),
                round(row.end_s, 4), shorten(row.before), shorten(row.after),
            ]
            for row in rows
        ],
        "runs": {
            row.number: [encode_runs(overlay, row.index) for overlay in groups[row.purpose]]
            for row in kept
        },
        "worst": worst.number if (worst := find_worst(rows)) else 0,
    }  # fmt: skip


def choose_windows(rows: Sequence[WindowRow]) -> list[WindowRow]:
    """Return the windows whose runs a page holds: all, or evenly spread with the worst."""
    kept = {int(k) for k in thin_out(len(rows), MOST_WINDOWS)} if rows else set()
    worst = find_worst(rows)
    if worst is not None:
        kept.add(worst.number - 1)
    return [rows[k] for k in sorted(kept)]


def encode_runs(overlay: Overlay, k: int) -> Json:
    """Return the measurement and both runs of a window; runs end where they leave the picture."""
    at = thin_out(overlay.times_s.shape[1], MOST_POINTS)
    measured = np.asarray(overlay.measured[k, at], dtype=np.float64)
    finite = measured[np.isfinite(measured)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 0.0)
    span = max(high - low, 1e-6 + 1e-3 * max(abs(low), abs(high)))
    middle, step = (low + high) / 2.0, (REACH + 0.5) * span / INT16
    lines = [
        np.where(np.isfinite(v), (np.clip(v, -1e30, 1e30) - middle) / step, np.inf)
        for v in (measured, overlay.before[k, at], overlay.after[k, at])
    ]
    drawn = np.stack([np.where(np.abs(v) <= INT16, np.round(v), -32768) for v in lines])
    return {
        "middle": middle,
        "step": step,
        "begin": float(overlay.times_s[k, 0]),
        "end": float(overlay.times_s[k, -1]),
        "lines": encode(drawn, "<i2"),
    }


def encode(values: Floats, kind: str = "<f4") -> str:
    """Return numbers as base64 of their bytes."""
    with np.errstate(over="ignore", invalid="ignore"):
        return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode()


def shorten(values: Sequence[float] | Floats) -> list[float | None]:
    """Return numbers with five digits; None for what is not finite or cannot be drawn."""
    return [
        float(f"{value:.5g}") if np.isfinite(value) and abs(value) < 1e30 else None
        for value in np.asarray(values, dtype=np.float64).tolist()
    ]
