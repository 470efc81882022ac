"""A row with more or fewer cells than the others is never read as if it were whole."""

from pathlib import Path

import numpy as np
import pytest

from pendulum_sysid.cli import main
from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.columns import Columns
from pendulum_sysid.reading.csv_import import import_csv, import_segments
from pendulum_sysid.reading.csv_table import read_csv_table

ALL = Columns("t", "u", "x", "theta")
ROWS = [[f"{k / 100:.2f}", "0.1", f"{k / 1e4:.4f}", "3.1"] for k in range(400)]


def write(path: Path, *rows: list[str], header: str = "t,u,x,theta", separator: str = ",") -> Path:
    lines = [header.replace(",", separator)] if header else []
    path.write_text("\n".join([*lines, *(separator.join(row) for row in rows), ""]))
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
@pytest.mark.parametrize(
    "row, count", [(["2.00", "0.1", "3.1"], 3), (["2.00", "0.1", "0.02", "3.1", "7"], 5)]
)
def test_a_row_with_a_cell_too_few_or_too_many_is_refused(
    tmp_path: Path, separator: str, row: list[str], count: int
) -> None:
    rows = [*ROWS[:200], row, *ROWS[201:300], ["3.00"], *ROWS[301:]]
    file = write(tmp_path / "run.csv", *rows, separator=separator)
    with pytest.raises(FileError) as refusal:
        import_csv(file, tmp_path / "bag", ALL)
    assert str(refusal.value) == (
        f"{file}: expected 4 cells in every row, as in the header, found {count} in line 202 "
        "(2 of 400 rows differ): correct them, or remove them"
    )
    assert not (tmp_path / "bag").exists()


def test_without_a_header_most_rows_say_how_many_cells_a_row_has(tmp_path: Path) -> None:
    file = write(tmp_path / "run.csv", ["0", "1"], *ROWS, header="")
    with pytest.raises(
        FileError, match="expected 4 cells in every row, as in most rows, found 2 in line 1 "
    ):
        read_csv_table(file)


def test_names_with_blanks_between_blanks_name_nothing(tmp_path: Path) -> None:
    header = "time [s] command cart [m] pole [rad]"
    file = write(tmp_path / "run.csv", *ROWS, header=header, separator=" ")
    import_csv(file, tmp_path / "bag", Columns("1", "2", "3", "4"))
    np.testing.assert_allclose(read_bag(tmp_path / "bag").cart, np.arange(400) / 1e4)
    with pytest.raises(WrongUse, match="4 names, time among them, found none in line 1: give"):
        import_csv(file, tmp_path / "named", Columns("time", pole="4"))


@pytest.mark.parametrize("separator", [",", ";", "\t"])
@pytest.mark.parametrize("of_header", ["", ","])
def test_separators_at_the_end_of_lines_are_no_cells(
    tmp_path: Path, separator: str, of_header: str
) -> None:
    rows = [[*row, ""] if k % 2 else row for k, row in enumerate(ROWS)]
    header = "t,u,x,theta" + of_header
    file = write(tmp_path / "run.csv", *rows, header=header, separator=separator)
    import_csv(file, tmp_path / "bag", ALL)
    raw = read_bag(tmp_path / "bag")
    np.testing.assert_allclose(raw.cart, np.arange(400) / 1e4)
    np.testing.assert_allclose(raw.pole, 3.1)


def test_text_behind_the_numbers_may_be_missing_or_hold_separators(tmp_path: Path) -> None:
    notes = ["", "ok", "stopped, by hand", "ok"]
    rows = [[*row, notes[k % 4]] if k % 4 else row for k, row in enumerate(ROWS)]
    file = write(tmp_path / "run.csv", *rows, header="t,u,x,theta,note")
    imported = import_csv(file, tmp_path / "bag", ALL)
    assert imported.rows == 400 and not imported.warnings
    np.testing.assert_allclose(read_bag(tmp_path / "bag").cart, np.arange(400) / 1e4)
    shifted = [*rows[:200], ["2.00", "0.1", "3.1", "ok"], *rows[201:]]
    with pytest.raises(FileError, match="found 4 in line 202 "):
        read_csv_table(write(tmp_path / "no.csv", *shifted, header="t,u,x,theta,note"))


@pytest.mark.parametrize("header", ["t,u,x,theta,note", "t, s,u,x,theta", "u,x,theta"])
def test_a_header_with_other_cells_than_the_rows_names_nothing(
    tmp_path: Path, header: str
) -> None:
    file = write(tmp_path / "run.csv", *ROWS, header=header)
    import_csv(file, tmp_path / "bag", Columns("1", "2", "3", "4"))
    np.testing.assert_allclose(read_bag(tmp_path / "bag").cart, np.arange(400) / 1e4)
    with pytest.raises(WrongUse, match="with 4 names, x among them, found none in line 1: give"):
        import_csv(file, tmp_path / "named", Columns("1", "2", "x", "4"))


def test_lines_of_text_behind_the_last_row_are_left_out_with_a_warning(tmp_path: Path) -> None:
    file = write(tmp_path / "run.csv", *ROWS, ["end of recording"], ["checked, by me"])
    imported = import_csv(file, tmp_path / "bag", ALL)
    assert imported.rows == 400
    assert [w.split(" holds")[0] for w in imported.warnings] == ["line 403", "line 402"]


def test_cells_that_are_empty_stay_in_their_place(tmp_path: Path) -> None:
    """Tabs at both ends of a row stand beside empty cells; only the first cell must be there."""
    rows = [list(row) for row in ROWS]
    rows[5][3] = rows[7][3] = ""
    import_csv(write(tmp_path / "run.csv", *rows, separator="\t"), tmp_path / "bag", ALL)
    raw = read_bag(tmp_path / "bag")
    assert raw.pole is not None
    assert np.flatnonzero(np.isnan(raw.pole)).tolist() == [5, 7]
    rows[9][0] = ""
    with pytest.raises(FileError, match="expected a time in every row, found none in line 11"):
        import_csv(write(tmp_path / "no.csv", *rows, separator="\t"), tmp_path / "no", ALL)


def test_a_last_row_that_was_cut_off_is_left_out_with_a_warning(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = write(tmp_path / "run.csv", *ROWS)
    file.write_text(file.read_text() + "4.00,0.1")
    words = ["--time", "t", "--command", "u", "--cart", "x", "--pole", "theta"]
    assert main(["import", str(file), "--out", str(tmp_path / "bag"), *words]) == 0
    said = capsys.readouterr()
    assert "400 rows in 3.99 s" in said.out
    assert said.err == (
        f"sysid: warning: {tmp_path / 'bag'}: the file ends in line 402 with 2 of 4 cells: "
        "this row is left out\n"
    )


def test_the_run_that_was_cut_off_says_so(tmp_path: Path) -> None:
    rows = [[*row, str(k // 200)] for k, row in enumerate(ROWS)]
    file = write(tmp_path / "run.csv", *rows, ["4.00", "0.1"], header="t,u,x,theta,run")
    columns = Columns("t", "u", "x", "theta", segment="run")
    first, second = import_segments(file, tmp_path / "out", columns).values()
    assert (len(first.warnings), len(second.warnings)) == (0, 1)


# Recordings that no verb takes


def test_the_same_time_in_all_rows_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path / "run.csv", *(["5.0", *row[1:]] for row in ROWS))
    with pytest.raises(FileError, match="times that rise in column t, found 5 in all 400 rows"):
        import_csv(file, tmp_path / "bag", ALL)
    assert not (tmp_path / "bag").exists()


def test_a_single_row_is_no_recording(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="expected rows of numbers below the header, found 1"):
        import_csv(write(tmp_path / "run.csv", ROWS[0]), tmp_path / "bag", ALL)


@pytest.mark.parametrize("rows, rate, warns", [(99, 20, 1), (100, 20, 0), (150, 100, 1)])
def test_a_recording_that_is_too_short_for_every_verb_is_warned_of(
    tmp_path: Path, rows: int, rate: int, warns: int
) -> None:
    columns = Columns(None, "u", "x", rate_hz=rate)
    imported = import_csv(write(tmp_path / "run.csv", *ROWS[:rows]), tmp_path / "bag", columns)
    assert len(imported.warnings) == warns
    assert all(f"found {rows} samples in" in warning for warning in imported.warnings)
