"""The history of a rig: every size over time, what changed when, and what is expected next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import timedelta

import numpy as np
import pandas as pd

from pendulum_sysid import decisions
from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.bounds import clip_pooled, clip_to_bounds, get_bounds
from pendulum_sysid.fleet.changes import Change, Course, Piece, find_changes
from pendulum_sysid.fleet.pooling import Pooled, pool_estimates
from pendulum_sysid.fleet.rows import RIG, UNANSWERED, UNLIKE_RIG
from pendulum_sysid.fleet.store import Store
from pendulum_twin.arrays import Floats
from pendulum_twin.suggest import ask_if_meant

PRESENCE = "named"  # parameter that says whether an effect was named: 1 or 0
WEEK_S = 7 * 86_400.0
MOST_TIMES = 10.0  # ratio; a change by more, as of an offset near 0, is told without a share


@dataclass(frozen=True)
class Size:
    """Hold one size of a rig over time.

    Attributes:
        owner: `rig` for a constant, else an effect.
        parameter: its name; `named` for whether the effect was named at all.
        unit: SI unit; empty for `named`.
        rows: the estimates: time, path, digest, value, low, high, error; by time.
        course: its pieces and changes.
        today: pooled since the last change; of a drift, where it is at the last recording.
        next_week: value, low and high expected at a recording a week after the last.
    """

    owner: str
    parameter: str
    unit: str
    rows: pd.DataFrame
    course: Course
    today: Pooled
    next_week: tuple[float, float, float]

    @property
    def name(self) -> str:
        """Return the name as a verdict has it."""
        return self.parameter if self.owner == RIG else f"{self.owner}.{self.parameter}"


@dataclass(frozen=True)
class History:
    """Hold what a store knows of one rig.

    Attributes:
        rig: its name.
        recordings: rows of the recordings that gave an answer, by time.
        unanswered: rows of the others.
        sizes: constants first, then effects.
        left_out: names of sizes that too few recordings fix, with their number.
    """

    rig: str
    recordings: pd.DataFrame
    unanswered: pd.DataFrame
    sizes: tuple[Size, ...]
    left_out: dict[str, int]

    @property
    def strange(self) -> pd.DataFrame:
        """Return the rows of the recordings that do not look like the rig."""
        return self.unanswered[self.unanswered["outcome"] == UNLIKE_RIG]

    @property
    def ends_strange(self) -> bool:
        """Return whether a recording that is unlike the rig is later than all answers."""
        if self.strange.empty:
            return False
        return bool(
            self.recordings.empty or self.strange["time"].max() > self.recordings["time"].max()
        )

    @property
    def is_diagnosed(self) -> bool:
        """Return whether a diagnosis gave an answer: a fit names no effects."""
        return "diagnose" in set(self.recordings["method"])

    @property
    def changes(self) -> list[tuple[Size, Change]]:
        """Return all changes with their sizes, the earliest first."""
        pairs = [(size, change) for size in self.sizes for change in size.course.changes]
        return sorted(pairs, key=lambda p: p[0].rows["time"].iloc[p[1].index])

    @property
    def drifts(self) -> list[Size]:
        """Return the sizes that drift through all of the history."""
        return [size for size in self.sizes if size.course.drift_chance < 1.0]


def read_histories(store: Store, rig: str | None = None) -> list[History]:
    """Return the histories of all rigs of a store, or of one.

    Raises FileError when the store knows no such rig, or nothing at all.
    """
    recordings, sizes = store.read_recordings(), store.read_sizes()
    names = list(dict.fromkeys(recordings["rig"]))
    if not names:
        raise FileError(
            f"{store.address}: expected recordings, found an empty store: run the fleet first"
        )
    if rig is not None and rig not in names:
        raise FileError(
            f"{store.address}: expected a rig of the store ({', '.join(names[:8])}), found "
            f"--rig {rig}: {ask_if_meant(rig, names) or 'name another'}"
        )
    return [
        make_history(name, recordings[recordings["rig"] == name], sizes[sizes["rig"] == name])
        for name in ([rig] if rig is not None else names)
    ]


def make_history(rig: str, recordings: pd.DataFrame, sizes: pd.DataFrame) -> History:
    """Return the history of a rig from its rows."""
    answered = ~recordings["outcome"].isin(UNANSWERED)
    usable = recordings[answered].reset_index(drop=True)
    series, left_out = [], {}
    for owner, parameter, unit, rows in _list_series(usable, sizes):
        name = parameter if owner == RIG else f"{owner}.{parameter}"
        if len(rows):
            series.append((owner, parameter, unit, rows))
        if len(rows) < decisions.LEAST_HISTORY:
            left_out[name] = len(rows)
    questions = max(sum(len(rows) >= decisions.LEAST_HISTORY for *_, rows in series), 1)
    return History(
        rig,
        usable,
        recordings[~answered].reset_index(drop=True),
        tuple(_make_size(*each, questions) for each in series),
        left_out,
    )


def _list_series(
    recordings: pd.DataFrame, sizes: pd.DataFrame
) -> Iterator[tuple[str, str, str, pd.DataFrame]]:
    """Yield each size with the rows that fix it, and whether each diagnosis named an effect.

    Whether is asked where the given twin lacks the effect, and as long as the newest one does.
    """
    sizes = sizes[~sizes["outcome"].isin(UNANSWERED)]
    diagnosed = recordings[recordings["method"] == "diagnose"]
    owners = sorted(set(sizes["owner"]), key=lambda owner: (owner != RIG, owner))
    for owner in owners:
        own = sizes[sizes["owner"] == owner]
        named = own[own["confidence"].notna() & (owner != RIG)]
        given = diagnosed["digest"].isin(set(own["digest"]) - set(named["digest"]))
        if diagnosed["digest"].isin(named["digest"]).any() and not given.iloc[-1]:
            yield owner, PRESENCE, "", _make_presence(diagnosed[~given], named)
        for parameter in dict.fromkeys(own["parameter"]):
            rows = own[(own["parameter"] == parameter) & own["identifiable"]].copy()
            if not parameter:
                continue
            rows["error"] = compute_errors(rows)
            rows = rows[np.isfinite(rows["value"]) & (rows["error"] > 0)]
            unit = own.loc[own["parameter"] == parameter, "unit"].iloc[0]
            yield owner, parameter, unit, rows.sort_values("time").reset_index(drop=True)


def compute_errors(rows: pd.DataFrame) -> Floats:
    """Return standard errors from 95 % intervals, of which a bound may have cut one side."""
    halves = np.maximum(rows["high"] - rows["value"], rows["value"] - rows["low"])
    return (halves / decisions.INTERVAL_DEVIATIONS).to_numpy(float)


def _make_presence(recordings: pd.DataFrame, named: pd.DataFrame) -> pd.DataFrame:
    rows = recordings[["time", "path", "digest"]].copy()
    rows["value"] = recordings["digest"].isin(named["digest"]).astype(float)
    count, n = rows["value"].sum(), len(rows)
    share = (count + 1.0) / (n + 2.0)  # Laplace's, so that it is never 0 or 1
    rows["error"] = np.sqrt(share * (1.0 - share))
    rows["low"] = rows["high"] = rows["value"]
    return rows


def _make_size(owner: str, parameter: str, unit: str, rows: pd.DataFrame, questions: int) -> Size:
    times = rows["time"].map(pd.Timestamp.timestamp).to_numpy(float)
    values, errors = (rows[name].to_numpy(float) for name in ("value", "error"))
    course = find_changes(times, values, errors, questions, parameter != PRESENCE)
    last = course.pieces[-1]
    today = pool_estimates(values[last.begin :], errors[last.begin :])
    ahead = today
    if last.slope:
        ahead = _read_drift(last, times[-1] + WEEK_S, course.spread, today.count)
        today = _read_drift(last, times[-1], course.spread, today.count)
    bounds = get_bounds(owner, parameter)
    expected = (ahead.value, ahead.expected_low, ahead.expected_high)
    value, low, high = (clip_to_bounds(end, bounds) for end in expected)
    today = clip_pooled(today, bounds)
    return Size(owner, parameter, unit, rows, course, today, (value, low, high))


def _read_drift(piece: Piece, time_s: float, spread: float, count: int) -> Pooled:
    """Return where a drift is at a time."""
    value = piece.predict(time_s)
    error = float(np.hypot(piece.error, piece.slope_error * (time_s - piece.middle_s)))
    half, ahead = (
        decisions.INTERVAL_DEVIATIONS * error,
        decisions.INTERVAL_DEVIATIONS * float(np.hypot(error, spread)),
    )
    ends = (value - half, value + half)
    return Pooled(value, *ends, error, spread, value - ahead, value + ahead, count)


def describe_when(size: Size, change: Change) -> str:
    """Return between which recordings a change lies, with 95 % probability."""
    rows = size.rows
    first, last = rows.iloc[change.earliest], rows.iloc[change.latest]
    return (
        f"between {format_time(first['time'])} ({name_recording(first['path'])}) and "
        f"{format_time(last['time'])} ({name_recording(last['path'])})"
    )


def describe_change(size: Size, change: Change) -> str:
    """Return a change as a sentence."""
    if size.parameter == PRESENCE:
        verb = "was named more often" if change.after > change.before else "was named less often"
        amount = (
            f"{verb}: in {change.before:.0%} of the recordings before, {change.after:.0%} after"
        )
    elif change.drifts:
        amount = f"began to drift: from {change.before:.4g} to {change.after:.4g} {size.unit}"
    else:
        amount = f"went from {change.before:.4g} to {change.after:.4g} {size.unit}"
        if abs(change.after) <= MOST_TIMES * abs(change.before):
            amount += f" ({change.after / change.before - 1:+.0%})"
    return (
        f"{size.owner if size.parameter == PRESENCE else size.name} {amount}, "
        f"{describe_when(size, change)}; {describe_chance(change.chance)}."
    )


def describe_drift(size: Size) -> str:
    """Return a drift through all of the history as a sentence."""
    piece, rows = size.course.pieces[0], size.rows
    first, last = rows["time"].iloc[0], rows["time"].iloc[-1]
    ends = [piece.predict(time.timestamp()) for time in (first, last)]
    return (
        f"{size.name} drifts all along, from {ends[0]:.4g} to {ends[1]:.4g} {size.unit} "
        f"({format_time(first)} to {format_time(last)}); "
        f"{describe_chance(size.course.drift_chance)}."
    )


def describe_chance(chance: float) -> str:
    """Return how often quiet histories show as much."""
    return f"of quiet histories at most one in {1 / chance:.3g} shows as much"


def describe_history(history: History) -> list[str]:
    """Return the answer: what changed, when, how sure, and what did not."""
    lines = [describe_change(*pair) for pair in history.changes]
    lines += [describe_drift(size) for size in history.drifts]
    if not any(len(s.rows) >= decisions.LEAST_HISTORY for s in history.sizes):
        lines = [
            f"{history.rig}: whether anything changed cannot be said: no size is fixed by "
            f"{decisions.LEAST_HISTORY} recordings."
        ]
    elif not lines:
        lines = [f"{history.rig}: no change shows in {len(history.recordings)} recordings."]
    return lines + describe_strange(history)


def describe_strange(history: History) -> list[str]:
    """Return a sentence about recordings that do not look like the rig; none without them."""
    strange = history.strange
    if strange.empty:
        return []
    last = strange.loc[strange["time"].idxmax()]
    count = "1 recording does" if len(strange) == 1 else f"{len(strange)} recordings do"
    return [
        f"{count} not look like {history.rig}, the last of {format_time(last['time'])} "
        f"({name_recording(last['path'])}): it is of another rig, or {history.rig} changed a lot."
    ]


def name_recording(path: str) -> str:
    """Return the last part of an address."""
    return path.rstrip("/").rsplit("/", 1)[-1]


def format_time(time: pd.Timestamp) -> str:
    """Return a time to the second; hours since its zero for times that count from a zero."""
    since = time.timestamp()
    if since < timedelta(days=365).total_seconds():
        return f"{since / 3600:.2f} h"
    return time.strftime("%Y-%m-%d %H:%M:%S")
