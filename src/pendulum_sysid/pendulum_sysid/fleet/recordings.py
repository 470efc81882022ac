"""Find the recordings in folders: rosbag2 folders, single data files, and tables of columns."""

from __future__ import annotations

import hashlib
import os
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path, PurePosixPath

from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.places import Place
from pendulum_sysid.fleet.table import RigEntry, find_rig
from pendulum_sysid.reading.array_table import ARRAY_SUFFIXES, read_array_table
from pendulum_sysid.reading.bag_files import DATA_SUFFIXES, INDEX, TABLE_SUFFIXES
from pendulum_sysid.reading.columns import EPOCH_S, TIME_UNITS, Columns
from pendulum_sysid.reading.csv_table import read_csv_table
from pendulum_twin.errors import BadInputError
from pendulum_twin.strict_yaml import parse_yaml

BLOCK_BYTES = 1 << 20


@dataclass(frozen=True)
class Source:
    """Hold where one recording is.

    folder: address of the folder that was given.
    name: path of the recording's folder or file within it.
    files: paths of its files within the folder, sorted; the index of a bag is not among them.
    """

    folder: str
    name: str
    files: tuple[str, ...]

    @property
    def path(self) -> str:
        """Return the address of the recording."""
        return f"{self.folder.rstrip('/')}/{self.name}".removesuffix("/.")

    @property
    def location(self) -> str:
        """Return the path without links on a disk of this machine, elsewhere the address."""
        return os.path.realpath(self.path) if Place(self.folder).is_local else self.path

    @property
    def is_table(self) -> bool:
        """Tell whether the recording is a file of columns, and no bag."""
        return self.name.lower().endswith(TABLE_SUFFIXES)


def find_sources(folder: str) -> list[Source]:
    """Return the recordings below a folder, by name.

    Raises FileError when the folder holds none.
    """
    place = Place(folder)
    names = place.list_files()
    folder = place.root if place.is_local else folder  # the same from wherever it is called
    bags = {str(PurePosixPath(n).parent) for n in names if PurePosixPath(n).name == INDEX}
    files: dict[str, list[str]] = {bag: [] for bag in bags}
    for name in names:
        parent, plain = str(PurePosixPath(name).parent), name.removesuffix(".zstd").lower()
        if parent in bags and plain.endswith(DATA_SUFFIXES):
            files[parent].append(name)
        elif plain.endswith(DATA_SUFFIXES) or name.lower().endswith(TABLE_SUFFIXES):
            files[name] = [name]
    if not files:
        raise FileError(
            f"{folder}: expected recordings (rosbag2 folders, or files of columns), found none: "
            "check the path"
        )
    return [Source(folder, name, tuple(sorted(f))) for name, f in sorted(files.items())]


def assign_rigs(
    sources: Sequence[Source], rigs: tuple[RigEntry, ...]
) -> tuple[list[tuple[Source, RigEntry]], list[Source]]:
    """Return the recordings with their rigs, and those that no rig of the table claims.

    A recording that is there by several ways (folders within each other, links) comes once a rig.
    """
    pairs: dict[tuple[str, str], tuple[Source, RigEntry]] = {}
    strays: dict[str, Source] = {}
    for source in sources:
        rig = find_rig(rigs, source.path)
        if rig is None or (source.is_table and rig.columns is None):
            strays.setdefault(source.location, source)
        else:
            pairs.setdefault((source.location, rig.name), (source, rig))
    claimed = {location for location, _ in pairs}
    return list(pairs.values()), [s for where, s in strays.items() if where not in claimed]


def measure_size(source: Source) -> int:
    """Return the bytes of a recording's files; one that is not there counts as none."""
    place, total = Place(source.folder), 0
    for name in source.files:
        with suppress(OSError):  # whoever reads the recording says what is wrong with it
            total += int(place.fs.size(place.locate(name)) or 0)
    return total


def compute_source_digest(source: Source) -> str:
    """Return "sha256:..." over the bytes of a recording's files, as a verdict has it.

    A bag without its data files gets the digest of its name: there is nothing else to tell it by.
    """
    place, digest = Place(source.folder), hashlib.sha256()
    if not source.files:
        digest.update(source.path.encode())
    for name in sorted(source.files, key=lambda n: PurePosixPath(n).name):
        try:
            with place.fs.open(place.locate(name), "rb") as stream:
                while block := stream.read(BLOCK_BYTES):
                    digest.update(block)
        except OSError:  # whoever reads the recording says what is wrong with it
            digest.update(f"unreadable: {name}".encode())
    return f"sha256:{digest.hexdigest()}"


@contextmanager
def fetch(source: Source) -> Iterator[Path]:
    """Give the recording as a path of this machine; a copy from elsewhere ends with the block.

    Raises FileError when a file of a recording elsewhere is gone.
    """
    place = Place(source.folder)
    if place.is_local:
        yield Path(place.locate(source.name))
        return
    with tempfile.TemporaryDirectory() as folder:
        here = Path(folder) / (PurePosixPath(source.name).name or "recording")
        if source.files == (source.name,):
            here.write_bytes(_read_whole(place, source, source.name))
            _keep_time(place, source.name, here)
        else:
            here.mkdir()
            for name in (*source.files, str(PurePosixPath(source.name) / INDEX)):
                (here / PurePosixPath(name).name).write_bytes(_read_whole(place, source, name))
        yield here


def _read_whole(place: Place, source: Source, name: str) -> bytes:
    """Return the content of a file of a recording; raise FileError where it is gone."""
    content = place.read(name)
    if content is None:
        raise FileError(
            f"{source.path}: expected {name}, found it gone: leave the files where they are while "
            "a run goes on"
        )
    return content


def _keep_time(place: Place, name: str, copy: Path) -> None:
    """Give a copy the time of its original, where the file system knows it."""
    try:
        time_s = place.fs.modified(place.locate(name)).timestamp()
        os.utime(copy, (time_s, time_s))
    except (NotImplementedError, AttributeError, KeyError, OSError):
        pass


def read_beginning(path: Path, columns: Columns | None) -> datetime:
    """Return when a recording began, UTC.

    A bag's index says it, a table its first time (seconds since 1970, or since any zero). Without
    either the time of the file counts.
    """
    try:
        if path.is_dir():
            index = parse_yaml((path / INDEX).read_text(encoding="utf-8"))
            start = index["rosbag2_bagfile_information"]["starting_time"]
            return _make_time(int(start["nanoseconds_since_epoch"]) * 1e-9)
        if columns is not None and columns.time is not None:
            is_array = path.suffix.lower() in ARRAY_SUFFIXES
            table = read_array_table(path, (columns.time,)) if is_array else read_csv_table(path)
            first = float(table.get_column(columns.time, "--time")[0])
            since_1970 = [u for u, s in TIME_UNITS.items() if EPOCH_S[0] <= first * s < EPOCH_S[1]]
            return _make_time(first * TIME_UNITS[columns.time_unit or (since_1970 or ["s"])[0]])
    except (OSError, ValueError, KeyError, TypeError, IndexError, OverflowError, BadInputError):
        pass  # whoever reads the recording says what is wrong with it
    return _make_time(path.stat().st_mtime if path.exists() else 0.0)


def _make_time(seconds: float) -> datetime:
    return datetime.fromtimestamp(round(seconds, 6), UTC)
