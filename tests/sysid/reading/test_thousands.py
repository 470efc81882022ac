"""Marks between thousands are not taken for marks of decimals."""

from pathlib import Path

import numpy as np
import pytest

from pendulum_sysid.errors import FileError
from pendulum_sysid.reading.csv_table import read_csv_table


def write(path: Path, separator: str, cells: list[str]) -> Path:
    rows = [separator.join((str(k), cell)) for k, cell in enumerate(cells)]
    path.write_text("\n".join([f"t{separator}x", *rows, ""]))
    return path


@pytest.mark.parametrize(
    "separator, cells",
    [
        (";", ["-3", "998", "1,002", "1,010"]),  # a point would have made 1.002 of it
        (";", ["-3", "998", "1.002", "-1.010"]),
        (",", ["998", "1.002"]),
        (";", ["998", "1,002", "1,234,567"]),
        (",", ["998", '"1,002"']),
    ],
)
def test_thousands_are_refused_with_the_line(
    separator: str, cells: list[str], tmp_path: Path
) -> None:
    table = read_csv_table(write(tmp_path / "log.csv", separator, cells))
    with pytest.raises(FileError, match=r"1[.,]002.* in line|in line .*1[.,]002") as refusal:
        table.get_column("x", "--cart")
    assert "column x" in str(refusal.value)


@pytest.mark.parametrize(
    "separator, cells, values",
    [
        (";", ["-0,003", "0,998", "1,002"], [-0.003, 0.998, 1.002]),
        (",", ["-0.003", "0.998", "1.002"], [-0.003, 0.998, 1.002]),
        (",", ["1.002", "1.25", "3"], [1.002, 1.25, 3.0]),  # trailing zeros left out
        (",", ["1.002", "2.125", "3.750"], [1.002, 2.125, 3.750]),
        (";", ["998", "1002", ""], [998.0, 1002.0, np.nan]),
        (",", ["0", "1.125", "-1.125", "0"], [0.0, 1.125, -1.125, 0.0]),  # two levels
        (",", ["1.500e3", "12"], [1500.0, 12.0]),
    ],
)
def test_decimals_of_three_digits_stay_decimals(
    separator: str, cells: list[str], values: list[float], tmp_path: Path
) -> None:
    table = read_csv_table(write(tmp_path / "log.csv", separator, cells))
    np.testing.assert_array_equal(table.get_column("x", "--cart"), values)
