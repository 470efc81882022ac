"""Examine the recordings of a fleet that a store does not know yet."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.engine import DIED, Ending, Engine, open_client, run_tasks
from pendulum_sysid.fleet.recordings import (
    Source,
    assign_rigs,
    compute_source_digest,
    find_sources,
    measure_size,
)
from pendulum_sysid.fleet.rows import GROWING, UNANSWERED, Result
from pendulum_sysid.fleet.store import Key, Store
from pendulum_sysid.fleet.table import RigEntry, read_table
from pendulum_sysid.fleet.warm_up import compile_kernels
from pendulum_sysid.fleet.work import Work, examine_recording, get_version, put_aside

WRITE_EVERY_S, WRITE_EVERY = 10.0, 200  # s, and recordings: so much a killed run loses at most

Progress = Callable[[str], None]


@dataclass
class Tally:
    """Count what a run came to.

    recordings: number of recordings in the folders.
    known: of them, those that the store had.
    done: that were examined now.
    unanswered: of these, those that gave no answer.
    strays: recordings that no rig of the table claims.
    """

    recordings: int = 0
    known: int = 0
    done: int = 0
    unanswered: int = 0
    strays: int = 0


def run_fleet(
    folders: Sequence[str],
    table: Path,
    address: str,
    engine: Engine,
    method: str,
    progress: Progress,
) -> Tally:
    """Examine what is new in folders, and write it into the store.

    folders: addresses, each with recordings below it.
    table: file that names the rigs and their twins.
    address: of the store.
    engine: where the work is done.
    method: diagnose or fit.
    progress: called with a line as recordings end, with the time left, and for each that failed.
    Raises BadInputError when folder, table, store or scheduler are not as expected.
    """
    rigs = read_table(table)
    pairs, strays = _claim_recordings(folders, table, rigs)
    for source in strays:
        progress(f"{source.path}: left out, for no rig of {table} claims it")
    tally = Tally(recordings=len(pairs) + len(strays), strays=len(strays))
    store = Store(address)
    store.create()
    twins = {rig.name: rig.twin.read_bytes() for rig in rigs}
    for rig in rigs:
        store.write_twin(rig.twin_digest, twins[rig.name])
    works = _peek(_list_work(pairs, twins, store, method, tally))
    if works is not None:
        _examine(works, engine, store, tally, len(pairs), progress)
        store.merge()
    return tally


def _claim_recordings(
    folders: Sequence[str], table: Path, rigs: tuple[RigEntry, ...]
) -> tuple[list[tuple[Source, RigEntry]], list[Source]]:
    """Return the recordings with their rigs, and those that no rig claims.

    Raises FileError when no rig claims any.
    """
    sources = [source for folder in folders for source in find_sources(folder)]
    pairs, strays = assign_rigs(sources, rigs)
    if not pairs:
        raise FileError(
            f"{table}: expected a rig for the {len(sources)} recordings, found that no pattern "
            f"fits {sources[0].name}: give the rig `recordings: PATTERN`"
        )
    return pairs, strays


def _list_work(
    pairs: Iterable[tuple[Source, RigEntry]],
    twins: Mapping[str, bytes],
    store: Store,
    method: str,
    tally: Tally,
) -> Iterator[Work]:
    """Yield the work on recordings that the store does not know; count the others as known.

    twins: rig -> its twin file.
    """
    done, version = store.list_done(), get_version()
    for source, rig in pairs:
        size_bytes = measure_size(source)
        digest = compute_source_digest(source)
        key: Key = (rig.name, digest, version, rig.twin_digest, method)
        if key in done:
            tally.known += 1
            continue
        done.add(key)
        yield Work(
            source=source,
            digest=digest,
            size_bytes=size_bytes,
            rig=rig.name,
            twin=twins[rig.name],
            twin_digest=rig.twin_digest,
            columns=rig.columns,
            method=method,
            store=store.address if method == "diagnose" else "",
        )


def _examine(
    works: Iterable[Work],
    engine: Engine,
    store: Store,
    tally: Tally,
    total: int,
    progress: Progress,
) -> None:
    """Examine the recordings on a cluster, and write what comes of them into the store."""
    with open_client(engine, compile_kernels) as client:

        def examine(some: Iterable[Work]) -> Iterator[Ending[Work, Result]]:
            return run_tasks(client, examine_recording, some, engine.time_limit_s)

        died: list[Work] = []
        endings = _hold_back(examine(works), died, progress)
        _collect(endings, store, tally, total, progress)
        _collect(examine(died), store, tally, total, progress)


def _peek(works: Iterator[Work]) -> Iterator[Work] | None:
    """Return the same works, None where there is none: no cluster is needed then."""
    first = next(works, None)
    if first is None:
        return None

    def give_all() -> Iterator[Work]:
        yield first
        yield from works

    return give_all()


def _hold_back(
    endings: Iterator[Ending[Work, Result]], died: list[Work], progress: Progress
) -> Iterator[Ending[Work, Result]]:
    """Yield the endings but those whose worker died twice: these have a last try at the end.

    A machine that goes down takes the recordings with it that it works on, whatever they are.
    """
    for ending in endings:
        if ending.put_aside == DIED:
            died.append(ending.item)
            progress(f"{ending.item.source.path}: put aside: {DIED}; tried again at the end")
        else:
            yield ending


def _collect(
    endings: Iterator[Ending[Work, Result]],
    store: Store,
    tally: Tally,
    total: int,
    progress: Progress,
) -> None:
    """Write the results in batches as they come, and what has come when the run is broken off."""
    batch: list[Result] = []
    began = written_s = time.monotonic()
    try:
        for ending in endings:
            result = _settle(ending)
            tally.done += 1
            row = result.recording
            if row.outcome != GROWING:
                batch.append(result)
            if row.outcome in (GROWING, *UNANSWERED):
                tally.unanswered += 1
                progress(f"{row.path}: {row.outcome}: {row.sentence}")
            now_s = time.monotonic()
            left = total - tally.known - tally.done
            left_s = (now_s - began) / tally.done * left
            progress(
                f"{tally.done + tally.known}/{total} {row.rig} {row.path.rsplit('/', 1)[-1]}: "
                f"{row.outcome}, {_format_seconds(left_s)} left"
            )
            if len(batch) >= WRITE_EVERY or now_s - written_s >= WRITE_EVERY_S:
                store.write(batch)
                batch, written_s = [], now_s
    finally:
        store.write(batch)


def _settle(ending: Ending[Work, Result]) -> Result:
    if ending.result is not None:
        return ending.result
    if ending.error is not None:
        raise ending.error
    return put_aside(ending.item, ending.put_aside)


def _format_seconds(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 5400 else f"{seconds / 3600:.1f} h"
