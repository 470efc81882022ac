"""The task of a fleet: one recording, from its files to its rows. It runs in a worker."""

from __future__ import annotations

import gzip
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from importlib import metadata
from pathlib import Path

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.fitting.fit import fit_own_parameters
from pendulum_sysid.fitting.parameters import list_free_parameters
from pendulum_sysid.fitting.window_runs import run_windows
from pendulum_sysid.fleet.recordings import Source, fetch, measure_size, read_beginning
from pendulum_sysid.fleet.rows import (
    FAILED,
    GROWING,
    PUT_ASIDE,
    RIG,
    UNLIKE_RIG,
    RecordingRow,
    Result,
    SizeRow,
)
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.pipeline import diagnose
from pendulum_sysid.prepare import prepare
from pendulum_sysid.reading.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
from pendulum_sysid.reading.columns import Columns
from pendulum_sysid.reading.csv_import import import_csv
from pendulum_sysid.records import Estimate, Fit, Outcome, Recording
from pendulum_sysid.telling.output_files import format_json
from pendulum_sysid.telling.report import render_page
from pendulum_sysid.verdict.record import RigParameter, Verdict
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import Twin, load_twin, save_twin

FITTED = "fitted"
STILL_WRITTEN = "it is still being written: run the same command again when it is whole"


@dataclass(frozen=True)
class Work:
    """Hold what a task needs: small, and without the recording itself.

    source: where the recording is.
    digest: of its files.
    size_bytes: of its files, when the digest was taken.
    rig: whose it is.
    twin: content of the twin file to start from.
    twin_digest: of that file.
    columns: of a CSV file; None for a bag.
    method: diagnose, or fit: the sizes of the twin as it is, nothing added.
    store: address that gets the full verdict and its report; empty for none.
    topics: of states and commands in a bag.
    """

    source: Source
    digest: str
    size_bytes: int
    rig: str
    twin: bytes
    twin_digest: str
    columns: Columns | None
    method: str
    store: str
    topics: tuple[str, str] = (STATE_TOPIC, COMMAND_TOPIC)


def get_version() -> str:
    """Return the version of pendulum_sysid that does the work."""
    return metadata.version("pendulum_sysid")


def examine_recording(work: Work) -> Result:
    """Return the rows of one recording; what is wrong with it is an answer, not an error."""
    began = time.process_time()
    row = make_row(work, FAILED, "")
    sizes: tuple[SizeRow, ...] = ()
    try:
        with fetch(work.source) as path:
            row = replace(row, time=read_beginning(path, work.columns))
            with _read(path, work) as recording:
                row = replace(row, seconds=recording.signals.seconds)
                answer = _fit if work.method == "fit" else _diagnose
                row, sizes = answer(row, recording, work)
                row = _add_losses(row, recording)
    except BadInputError as refusal:
        row = replace(row, outcome=Outcome.UNUSABLE.value, sentence=str(refusal))
    except Exception as crash:  # a finding about the diagnosis, not the end of the run
        row = replace(row, sentence=f"internal error ({type(crash).__name__}: {crash})")
    if _is_growing(work):
        return Result(make_row(work, GROWING, STILL_WRITTEN))
    return Result(replace(row, cpu_s=time.process_time() - began), sizes)


def _is_growing(work: Work) -> bool:
    return measure_size(work.source) != work.size_bytes


def _add_losses(row: RecordingRow, recording: Recording) -> RecordingRow:
    """Return the row with what its file lost added to the sentence."""
    if not recording.losses:
        return row
    return replace(row, sentence=f"{row.sentence} The file is not whole: {recording.losses}.")


def make_row(work: Work, outcome: str, sentence: str) -> RecordingRow:
    """Return the row of a recording of which nothing is known but its outcome."""
    return RecordingRow(
        rig=work.rig,
        time=datetime.fromtimestamp(0, UTC),
        digest=work.digest,
        path=work.source.path,
        outcome=outcome,
        sentence=sentence,
        method=work.method,
        twin=work.twin_digest,
        version=get_version(),
        written_at=datetime.now(UTC),
    )


def put_aside(work: Work, why: str) -> Result:
    """Return the row of a recording that ended its worker."""
    row = make_row(work, PUT_ASIDE, why)
    try:
        with fetch(work.source) as path:
            row = replace(row, time=read_beginning(path, work.columns))
    except (OSError, BadInputError):
        pass
    return Result(row)


@contextmanager
def _read(path: Path, work: Work) -> Iterator[Recording]:
    """Give the recording, cleaned; columns go through the same import as everybody's."""
    if not work.source.is_table:
        yield clean_recording(read_bag(path, *work.topics))
        return
    with tempfile.TemporaryDirectory() as folder:
        bag = Path(folder) / path.stem
        import_csv(path, bag, work.columns or Columns())
        yield clean_recording(read_bag(bag))


def _load_twin(content: bytes) -> Twin:
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "twin.yaml"
        file.write_bytes(content)
        return load_twin(file)


def _diagnose(
    row: RecordingRow, recording: Recording, work: Work
) -> tuple[RecordingRow, tuple[SizeRow, ...]]:
    verdict = diagnose([recording], _load_twin(work.twin), _discard)
    if work.store and not _is_growing(work):
        _keep_verdict(verdict, work)
    return fill_row(row, verdict), list_sizes(row, verdict)


def fill_row(row: RecordingRow, verdict: Verdict) -> RecordingRow:
    """Return the row with what the verdict says."""
    outcome = UNLIKE_RIG if verdict.unlike_rig else verdict.outcome.value
    row = replace(row, outcome=outcome, sentence=verdict.sentence)
    if verdict.location is not None:
        row = replace(row, place=verdict.location.place)
    if verdict.fit is not None:
        held_out = verdict.fit.held_out
        row = replace(
            row, before=held_out.before, after=held_out.after, floor=verdict.fit.noise_floor
        )
    return row


def list_sizes(row: RecordingRow, verdict: Verdict) -> tuple[SizeRow, ...]:
    """Return the sizes of a verdict: of what the given twin has, and of what it lacks."""
    given = verdict.list_given_values()
    sizes = [_make_given_size(row, name, p.unit, p.after, p) for name, p in given.items()]
    nan = float("nan")
    for effect in verdict.missing_physics:
        own = (row.rig, row.digest, effect.effect)
        sizes += [
            SizeRow(*own, name, p.unit, p.value, p.low, p.high, effect.confidence)
            for name, p in effect.parameters.items()
        ] or [SizeRow(*own, "", "", nan, nan, nan, effect.confidence)]
    return tuple(sizes)


def _fit(
    row: RecordingRow, recording: Recording, work: Work
) -> tuple[RecordingRow, tuple[SizeRow, ...]]:
    """Return the sizes of the twin as it is, by a fit to this recording."""
    prepared = prepare([recording], _load_twin(work.twin))
    case, split = prepared.case, prepared.split
    fitted = fit_own_parameters(case, split)
    before, after = (
        run_windows(replace(case, twin=twin), split.held_out).score
        for twin in (case.twin, fitted.twin)
    )
    row = replace(
        row,
        outcome=FITTED,
        sentence=f"The sizes of the twin were fitted; {len(fitted.estimates)} of them.",
        before=float(before),
        after=float(after),
    )
    free = list_free_parameters(case.twin, fitted.effects, case.scales)
    return row, list_fitted_sizes(row, fitted, {f.name: f.unit for f in free})


def list_fitted_sizes(
    row: RecordingRow, fitted: Fit, units: Mapping[str, str]
) -> tuple[SizeRow, ...]:
    """Return the estimates of a fit; units are keyed as its estimates."""
    return tuple(
        _make_given_size(row, name, units.get(name, ""), e.value, e)
        for name, e in fitted.estimates.items()
    )


def _make_given_size(
    row: RecordingRow, name: str, unit: str, value: float, fitted: Estimate | RigParameter
) -> SizeRow:
    """Return the row of a size that the given twin has: a constant, or effect.parameter."""
    owner, _, parameter = name.rpartition(".")
    return SizeRow(
        row.rig, row.digest, owner or RIG, parameter, unit,
        float(value), float(fitted.low), float(fitted.high),
        identifiable=bool(fitted.identifiable) and not fitted.at_bound,
    )  # fmt: skip


def _keep_verdict(verdict: Verdict, work: Work) -> None:
    """Write verdict, report and improved twin into the store; the report packed, for its size."""
    store = Store(work.store)
    folder = store.name_verdict_folder(work.rig, work.digest)
    store.place.write(f"{folder}/verdict.json", (format_json(verdict.to_dict()) + "\n").encode())
    store.place.write(f"{folder}/report.html.gz", gzip.compress(render_page(verdict).encode()))
    if verdict.twin is not None:
        with tempfile.TemporaryDirectory() as temporary:
            save_twin(verdict.twin, Path(temporary) / "twin.yaml")
            content = (Path(temporary) / "twin.yaml").read_bytes()
        store.place.write(f"{folder}/twin.yaml", content)
    else:  # of an earlier diagnosis
        store.place.remove(f"{folder}/twin.yaml")


def _discard(line: str) -> None:
    """Take a line of progress that nobody reads."""
