"""Files and folders by address: a path, s3://bucket/folder, sftp://host/folder, and others."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import parse_qsl, urlsplit

import fsspec
import pyarrow as pa
from fsspec.implementations.arrow import ArrowFSWrapper
from fsspec.implementations.local import LocalFileSystem
from pyarrow.fs import S3FileSystem

from pendulum_sysid.errors import FileError
from pendulum_twin.files import write_atomically

ENDPOINT = "AWS_ENDPOINT_URL"  # environment: of another server than Amazon's


class Place:
    """A folder on any file system.

    fs: the file system, as fsspec has it.
    root: the folder, as the file system names it.
    """

    def __init__(self, address: str) -> None:
        self.address = address
        self.fs, self.root = _open_filesystem(address)
        self.root = self.root.rstrip("/")

    @property
    def is_local(self) -> bool:
        """Tell whether the folder is on a disk of this machine."""
        return isinstance(self.fs, LocalFileSystem)

    def locate(self, *parts: str) -> str:
        """Return the path of a file in the folder."""
        return "/".join((self.root, *parts))

    def write(self, name: str, content: bytes) -> None:
        """Write a file whole or not at all."""
        try:
            if self.is_local:
                write_atomically(self.locate(name), content)
            else:
                self.fs.pipe_file(self.locate(name), content)
        except OSError as error:
            raise self._name_error("a place to write to", error) from error

    def read(self, name: str) -> bytes | None:
        """Return the content of a file; None where there is none."""
        try:
            content: bytes = self.fs.cat_file(self.locate(name))
            return content
        except FileNotFoundError:
            return None
        except OSError as error:
            raise self._name_error("a readable folder", error) from error

    def remove(self, name: str) -> None:
        """Remove a file; it may be gone already.

        Raises FileError when the place does not let it go.
        """
        try:
            self.fs.rm_file(self.locate(name))
        except FileNotFoundError:
            pass
        except OSError as error:
            raise self._name_error("files that may be removed", error) from error

    def list_files(self, folder: str = "") -> list[str]:
        """Return the names of all files below a folder of the place, sorted."""
        start = self.locate(folder) if folder else self.root
        try:
            if not self.fs.exists(start):
                return []
            paths = find_files(start) if self.is_local else self.fs.find(start)
            names = [path.removeprefix(self.root + "/") for path in paths]
            return sorted(n for n in names if not Path(n).name.startswith("."))
        except OSError as error:
            raise self._name_error("a readable folder", error) from error

    def _name_error(self, what: str, error: OSError) -> FileError:
        reason = error.strerror or str(error).split(":")[0]
        return FileError(f"{self.address}: expected {what}, found {reason}: check the address")


def find_files(folder: str, above: frozenset[str] = frozenset()) -> Iterator[str]:
    """Yield the paths of all files below a local folder; links to folders are followed.

    above: the folders on the way here, without links: a link back to one of them is not followed.
    Raises OSError for a folder that cannot be read; below it, such folders are left out.
    """
    here = os.path.realpath(folder)
    if here in above:
        return
    try:
        with os.scandir(folder) as listed:
            entries = list(listed)
    except PermissionError:
        if above:  # such as the lost+found of a disk
            return
        raise
    for entry in entries:
        if entry.is_dir():
            yield from find_files(entry.path, above | {here})
        else:
            yield entry.path


def _open_filesystem(address: str) -> tuple[fsspec.AbstractFileSystem, str]:
    """Return the file system and path of an address.

    S3 goes through pyarrow's own client, which the store needs anyway: AWS_ENDPOINT_URL, or
    `?endpoint_override=host:port&scheme=http` behind the address, name another server.
    """
    try:
        if address.startswith("s3://"):
            parts = urlsplit(address)
            options = dict(parse_qsl(parts.query))
            if os.environ.get(ENDPOINT) and "endpoint_override" not in options:
                options["endpoint_override"] = os.environ[ENDPOINT]
            return ArrowFSWrapper(S3FileSystem(**options)), parts.netloc + parts.path
        if "://" not in address:
            return LocalFileSystem(auto_mkdir=True), str(Path(address).absolute())
        fs, path = fsspec.core.url_to_fs(address)
        return fs, path
    except (OSError, ValueError, ImportError, TypeError, pa.ArrowInvalid) as error:
        raise FileError(
            f"{address}: expected a path or an address that fsspec knows, found {error}: check it"
        ) from error
