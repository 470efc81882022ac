"""The rows of a store: one a recording, and one a size (a constant or an effect's parameter)."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, fields
from datetime import datetime
from typing import Any

import pyarrow as pa

from pendulum_sysid.records import Outcome

# Outcomes beside those of a diagnosis; a recording that is unlike its rig may be of another rig.
PUT_ASIDE, FAILED, UNLIKE_RIG = "put_aside", "failed", "unlike_rig"
UNANSWERED = (PUT_ASIDE, FAILED, UNLIKE_RIG, Outcome.UNUSABLE.value)
# Of a recording whose files grew while it was examined. The store never holds it: the whole
# recording has another digest, and would stand beside its own beginning.
GROWING = "growing"
RIG = "rig"  # owner of the rig's constants


@dataclass(frozen=True)
class RecordingRow:
    """Hold what became of one recording.

    Attributes:
        rig: name of the rig in the table of twins.
        time: when the recording began, UTC.
        digest: "sha256:..." over the bytes of its files.
        path: where it was found.
        seconds: its length, s; NaN when it could not be read.
        outcome: of the diagnosis; `fitted`; `failed` (an internal error); `put_aside`;
            `unlike_rig` (no size of it counts for the rig).
        sentence: the answer, or why there is none.
        place: where in the chain the twin is wrong; empty for nowhere.
        before, after: held-out scores of the twin as given and of the improved twin; NaN for none.
        floor: score of a perfect model on the same windows; NaN where it was not measured.
        method: diagnose or fit.
        twin: digest of the twin file that the work started from.
        version: of pendulum_sysid.
        cpu_s: CPU time of the work, s.
        written_at: when the row was written, UTC.
        batch: the write that the row came with.
    """

    rig: str
    time: datetime
    digest: str
    path: str
    outcome: str
    sentence: str
    method: str
    twin: str
    version: str
    written_at: datetime
    seconds: float = float("nan")
    place: str = ""
    before: float = float("nan")
    after: float = float("nan")
    floor: float = float("nan")
    cpu_s: float = float("nan")
    batch: str = ""


@dataclass(frozen=True)
class SizeRow:
    """Hold one size that a recording gave, in `unit`, with its 95 % interval.

    Attributes:
        rig, digest, batch: of the recording's row.
        owner: `rig` for a constant, else the effect.
        parameter: name of the constant or of the effect's parameter; empty for an effect that is
            on or off.
        value, low, high: the estimate and its interval; NaN for an effect that is on or off.
        confidence: 0 to 1, that the effect is there which the given twin lacks; NaN for what the
            given twin has: nobody asked whether it is there.
        identifiable: False where the recording does not fix the value.
    """

    rig: str
    digest: str
    owner: str
    parameter: str
    unit: str
    value: float
    low: float
    high: float
    confidence: float = float("nan")
    identifiable: bool = True
    batch: str = ""


@dataclass(frozen=True)
class Result:
    """Hold the rows of one recording: what a task returns."""

    recording: RecordingRow
    sizes: tuple[SizeRow, ...] = field(default=())


_TYPES = {
    "datetime": pa.timestamp("us", tz="UTC"),
    "float": pa.float64(),
    "bool": pa.bool_(),
    "str": pa.string(),
}
RECORDING_SCHEMA = pa.schema([(f.name, _TYPES[str(f.type)]) for f in fields(RecordingRow)])
SIZE_SCHEMA = pa.schema([(f.name, _TYPES[str(f.type)]) for f in fields(SizeRow)])


def make_table(rows: list[Any], schema: pa.Schema) -> pa.Table:
    """Return records of one kind as a table."""
    return pa.Table.from_pylist([asdict(row) for row in rows], schema=schema)
