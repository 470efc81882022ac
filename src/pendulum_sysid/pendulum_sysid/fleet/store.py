"""The store: a Parquet dataset of results, partitioned by rig, with the full verdicts beside it.

A write is two files of the same name for each rig: first the sizes, then the recordings, which
make it count. A run that is killed between the two leaves sizes without a recording, which nobody
reads. The same recording may be written twice (two runs at once, a work that is done again): the
reader takes the latest row that is an answer.
"""

from __future__ import annotations

import io
import json
import uuid
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from urllib.parse import quote

import duckdb
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.places import Place
from pendulum_sysid.fleet.rows import (
    PUT_ASIDE,
    RECORDING_SCHEMA,
    SIZE_SCHEMA,
    Result,
    make_table,
)

SCHEMA = "pendulum_store/1"
HEADER = "store.json"
RECORDINGS, SIZES, VERDICTS, TWINS = "recordings", "sizes", "verdicts", "twins"
FILES_MERGED = 16  # files of a rig, from which a run merges them at its end
DIGEST_DIGITS = 16  # of a digest, in the name of a folder

Key = tuple[str, str, str, str, str]  # rig, digest, version, twin, method

LATEST = f"""
    SELECT * EXCLUDE (place_in_row) FROM (
        SELECT *, row_number() OVER (
            PARTITION BY rig, digest ORDER BY outcome = '{PUT_ASIDE}', written_at DESC, batch
        ) AS place_in_row FROM every_row
    ) WHERE place_in_row = 1 ORDER BY rig, time, digest
"""
# distinct: while files are merged a row may be there twice, in the same batch
JOINED = """
    SELECT DISTINCT s.* EXCLUDE (batch), r.time, r.outcome, r.path
    FROM every_size s JOIN latest r ON s.rig = r.rig AND s.digest = r.digest AND s.batch = r.batch
    ORDER BY rig, time, digest, owner, parameter
"""


class Store:
    """The results of many recordings, at a path or another address."""

    def __init__(self, address: str) -> None:
        self.address = address

    @cached_property
    def place(self) -> Place:
        """Return the folder of the store."""
        return Place(self.address)

    def create(self) -> None:
        """Begin a store, unless it is there.

        Raises FileError when the place holds a store of another version, or other files.
        """
        if self.place.read(HEADER) is None:
            if self.place.list_files():
                raise FileError(
                    f"{self.address}: expected a store or an empty folder, found other files: "
                    "name another folder"
                )
            self.place.write(HEADER, json.dumps({"schema": SCHEMA}).encode() + b"\n")
        self.check()

    def check(self) -> None:
        """Raise FileError unless a store of this version is there."""
        content = self.place.read(HEADER)
        if content is None:
            raise FileError(
                f"{self.address}: expected a store of `sysid fleet run`, found none: check the "
                "address"
            )
        try:
            schema = json.loads(content)["schema"]
        except (ValueError, TypeError, KeyError):
            schema = "an unreadable header"
        if schema != SCHEMA:
            raise FileError(
                f"{self.address}: expected a store with schema {SCHEMA}, found {schema}: read it "
                "with the version that wrote it, or name another folder"
            )

    def write(self, results: Sequence[Result]) -> None:
        """Write results, those of each rig whole or not at all."""
        rigs: dict[str, list[Result]] = defaultdict(list)
        for result in results:
            rigs[result.recording.rig].append(result)
        for rig, group in rigs.items():
            batch = uuid.uuid4().hex
            sizes = [replace(size, batch=batch) for result in group for size in result.sizes]
            rows = [replace(result.recording, batch=batch) for result in group]
            self._write_pair(
                rig, batch, make_table(rows, RECORDING_SCHEMA), make_table(sizes, SIZE_SCHEMA)
            )

    def merge(self) -> None:
        """Merge the files of each rig that has many; a reader meanwhile sees every row once."""
        rigs: dict[str, list[str]] = defaultdict(list)
        for name in self.place.list_files(RECORDINGS):
            rigs[name.split("/")[1].removeprefix("rig=")].append(name)
        for names in rigs.values():
            if len(names) >= FILES_MERGED:
                self._merge_files(names)

    def list_done(self) -> set[Key]:
        """Return what needs no work any more: the latest rows but those that were put aside.

        A row that a later row of the recording replaces is read by nobody: what it answered (by
        another twin, method or version) is done again where it is wanted again.
        """
        frame = self.read_recordings()
        frame = frame[frame["outcome"] != PUT_ASIDE]
        columns = (frame[name] for name in ("rig", "digest", "version", "twin", "method"))
        return set(zip(*columns, strict=True))

    def read_recordings(self) -> pd.DataFrame:
        """Return the latest row of every recording, by rig and time."""
        return self.ask("SELECT * FROM latest")

    def read_sizes(self) -> pd.DataFrame:
        """Return the sizes of every recording's latest row, with its time, by rig and time."""
        return self.ask(JOINED)

    def ask(self, question: str) -> pd.DataFrame:
        """Return the answer to SQL on the views `latest` (recordings) and `every_size`."""
        self.check()
        with duckdb.connect() as database:
            database.execute("SET TimeZone = 'UTC'; SET threads = 1")
            rows = self._read_all(RECORDINGS, RECORDING_SCHEMA)
            sizes = self._read_all(SIZES, SIZE_SCHEMA)
            database.register("every_row", rows)
            database.register("every_size", sizes)
            database.execute(f"CREATE VIEW latest AS {LATEST}")
            return database.execute(question).df()

    def name_verdict_folder(self, rig: str, digest: str) -> str:
        """Return the folder of a recording's verdict and report, within the store."""
        short = digest.removeprefix("sha256:")[:DIGEST_DIGITS]
        return f"{VERDICTS}/rig={_quote(rig)}/{short}"

    def write_twin(self, digest: str, content: bytes) -> None:
        """Keep a twin file that work starts from."""
        self.place.write(_name_twin(digest), content)

    def read_twin(self, digest: str) -> bytes:
        """Return the twin file that work started from."""
        content = self.place.read(_name_twin(digest))
        if content is None:
            raise FileError(
                f"{self.address}: expected the twin {digest}, found it missing: run the "
                "fleet again"
            )
        return content

    def _merge_files(self, names: Sequence[str]) -> None:
        """Merge files of one rig; leave them to another run that is merging them, too."""
        pairs = [name.replace(RECORDINGS, SIZES, 1) for name in names]
        tables = [self._read(name, RECORDING_SCHEMA) for name in names]
        sizes = [self._read(name, SIZE_SCHEMA) for name in pairs]
        rows = [table for table in tables if table is not None]
        if len(rows) < len(names):
            return
        rig = rows[0].column("rig")[0].as_py()
        others = [table for table in sizes if table is not None] or [SIZE_SCHEMA.empty_table()]
        self._write_pair(rig, uuid.uuid4().hex, pa.concat_tables(rows), pa.concat_tables(others))
        for name in (*names, *pairs):
            self.place.remove(name)

    def _write_pair(self, rig: str, batch: str, rows: pa.Table, sizes: pa.Table) -> None:
        for kind, table in ((SIZES, sizes), (RECORDINGS, rows)):  # the recordings make it count
            stream = io.BytesIO()
            pq.write_table(table, stream, compression="zstd")
            self.place.write(f"{kind}/rig={_quote(rig)}/{batch}.parquet", stream.getvalue())

    def _read_all(self, kind: str, schema: pa.Schema) -> pa.Table:
        """Return all rows of a kind, from a listing whose files were all there when read."""
        while True:
            names = self._list_parquet(kind)
            tables = [self._read(name, schema) for name in names]
            gone = [name for name, table in zip(names, tables, strict=True) if table is None]
            if not gone or not set(gone).isdisjoint(self._list_parquet(kind)):
                whole = [table for table in tables if table is not None]
                return pa.concat_tables(whole or [schema.empty_table()])

    def _list_parquet(self, kind: str) -> list[str]:
        return [n for n in self.place.list_files(kind) if n.endswith(".parquet")]

    def _read(self, name: str, schema: pa.Schema) -> pa.Table | None:
        """Return the rows of a file; None where it is gone: another run merged it meanwhile."""
        content = self.place.read(name)
        if content is None:
            return None
        try:
            return pq.read_table(io.BytesIO(content), schema=schema, partitioning=None)
        except (pa.ArrowInvalid, OSError) as error:
            raise FileError(
                f"{self.address}: expected {name} as it was written, found it damaged: remove it "
                "and run the fleet again"
            ) from error


def _quote(rig: str) -> str:
    return quote(rig, safe="")


def _name_twin(digest: str) -> str:
    return f"{TWINS}/{digest.removeprefix('sha256:')[:DIGEST_DIGITS]}.yaml"
