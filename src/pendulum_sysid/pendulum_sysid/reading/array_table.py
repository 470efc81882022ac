"""Read the columns of MATLAB, NumPy and Parquet files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_sysid.errors import FileError
from pendulum_sysid.reading.table import Table
from pendulum_twin.arrays import Floats
from pendulum_twin.files import describe_read_error

ARRAY_SUFFIXES = (".mat", ".npz", ".parquet")
HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"
MATLAB_HEADER_BYTES = 512


def read_array_table(path: Path, like: Sequence[str | None] = ()) -> Table:
    """Return the columns of a .mat, .npz or .parquet file.

    like: names of columns; the first that is there has as many rows as the table. Without any,
        the longest column has.

    Each one-dimensional array of numbers is a column; a matrix gives a column NAME[k], k from 1,
    for each of its columns. Columns of other lengths stand last, and raise FileError when they are
    read. Raises FileError when the file cannot be read or holds no such array.
    """
    try:
        arrays = _load(path)
    except FileError:
        raise
    except Exception as error:  # three libraries with their own errors
        raise FileError(
            f"expected a {path.suffix.lower()} file, but it cannot be read "
            f"({describe_read_error(error)}): export it again"
        ) from error
    columns = _list_columns(arrays)
    longest = max(columns, key=lambda name: len(columns[name]), default="")
    guide = next((name for name in like if name in columns), longest)
    rows = len(columns.get(guide, ()))
    if rows < 2:
        raise FileError("expected arrays of numbers, found none: export each signal as an array")
    names = sorted(columns, key=lambda name: len(columns[name]) != rows)

    def read(place: int) -> Floats:
        values = columns[names[place]]
        if len(values) != rows:
            raise FileError(
                f"expected {rows} values in {names[place]}, as in {guide}, found {len(values)}: "
                "export both at the same instants"
            )
        return values

    return Table(tuple(names), len(names), tuple(range(1, rows + 1)), read)


def _load(path: Path) -> Mapping[str, Any]:
    if path.suffix.lower() == ".npz":
        with np.load(path, allow_pickle=False) as file:
            return dict(file)
    if path.suffix.lower() == ".mat":
        if _is_hdf5(path):  # version 7.3
            return _load_hdf5(path)
        from scipy.io import loadmat  # only for such files

        return dict(loadmat(path, squeeze_me=True))
    try:
        parquet = import_module("pyarrow.parquet")  # an optional package
    except ImportError as error:
        raise FileError(
            "expected pyarrow to be installed, which reads Parquet, found it missing: install it, "
            "or export the file as CSV"
        ) from error
    table = parquet.read_table(path)
    return {name: table[name].to_numpy() for name in table.column_names}


def _is_hdf5(path: Path) -> bool:
    """Tell whether HDF5's signature stands at the beginning, or behind MATLAB's own header."""
    with path.open("rb") as file:
        begin = file.read(MATLAB_HEADER_BYTES + len(HDF5_SIGNATURE))
    return begin.startswith(HDF5_SIGNATURE) or begin.endswith(HDF5_SIGNATURE)


def _load_hdf5(path: Path) -> dict[str, Any]:
    """Return the arrays of a MATLAB file of version 7.3, which is HDF5, by their paths in it.

    HDF5 holds MATLAB's arrays with their axes in reverse; a structure is a group.
    """
    try:
        h5py = import_module("h5py")  # an optional package
    except ImportError as error:
        raise FileError(
            "expected h5py to be installed, which reads MATLAB's version 7.3, found it missing: "
            "install it, or save the file with -v7"
        ) from error
    arrays: dict[str, Any] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and item.dtype.kind in "fiub" and "#" not in name:
            arrays[name.replace("/", ".")] = np.squeeze(item[()].T)

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return arrays


def _list_columns(arrays: Mapping[str, Any]) -> dict[str, Floats]:
    columns: dict[str, Floats] = {}
    for name, content in arrays.items():
        values = np.asarray(content)
        if values.dtype.names:  # a MATLAB structure of arrays
            fields = {
                field: values[field].item() for field in values.dtype.names if not values.ndim
            }
            columns |= {f"{name}.{field}": v for field, v in _list_columns(fields).items()}
        elif values.dtype.kind in "fiub" and values.ndim == 1:
            columns[name] = values.astype(np.float64)
        elif values.dtype.kind in "fiub" and values.ndim == 2:
            numbered = enumerate(values.T.astype(np.float64), 1)
            columns |= {f"{name}[{k}]": column for k, column in numbered}
    return columns
