"""Files that leave open what a column or a run is: refused with what to do, never guessed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pendulum_sysid.cli import main
from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.columns import Columns
from pendulum_sysid.reading.csv_import import import_csv, import_segments

TIMES = np.arange(400) / 100
X, TH = np.sin(TIMES), np.cos(TIMES)
ALL = Columns("t", "u", "x", "theta")
RUNS = Columns("t", "u", "x", "theta", segment="run")


def write(path: Path, header: str, *columns: np.ndarray) -> Path:
    rows = [",".join(map(repr, map(float, row))) for row in zip(*columns, strict=True)]
    path.write_text("\n".join([header, *rows, ""]))
    return path


def test_a_name_that_two_columns_have_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path / "file.csv", "t,u,angle,angle", TIMES, 0 * X, TH, 2 * TH)
    with pytest.raises(WrongUse, match=r"expected a single column angle, found 2 .*--pole 3 or 4"):
        import_csv(file, tmp_path / "bag", Columns("t", "u", pole="angle"))
    import_csv(file, tmp_path / "bag", Columns("t", "u", pole="4"))
    np.testing.assert_array_equal(read_bag(tmp_path / "bag").pole, 2 * TH)


def test_runs_are_named_by_all_digits_of_their_number(tmp_path: Path) -> None:
    run = np.repeat([20240101.0, 20240102.0, 0.1], [100, 150, 150])
    file = write(tmp_path / "file.csv", "t,u,x,theta,run", TIMES, 0 * X, X, TH, run)
    imported = import_segments(file, tmp_path / "out", RUNS)
    assert [path.name for path in imported] == ["20240101", "20240102", "0.1"]


def test_a_file_whose_rows_belong_to_no_run_is_refused(tmp_path: Path) -> None:
    file = write(tmp_path / "file.csv", "t,u,x,theta,run", TIMES, 0 * X, X, TH, np.nan * X)
    with pytest.raises(FileError, match="expected the number of a run in column run, found none"):
        import_segments(file, tmp_path / "out", RUNS)


def test_a_run_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    run = np.repeat([1.0, 2.0], [399, 1])
    file = write(tmp_path / "file.csv", "t,u,x,theta,run", TIMES, 0 * X, X, TH, run)
    with pytest.raises(FileError, match="run 2 from line 401: expected rows of numbers"):
        import_segments(file, tmp_path / "out", RUNS)


def test_a_suffix_may_be_written_large(tmp_path: Path) -> None:
    with (tmp_path / "RUN.NPZ").open("wb") as stream:
        np.savez(stream, t=TIMES, u=0 * X, x=X, theta=TH)
    import_csv(tmp_path / "RUN.NPZ", tmp_path / "bag", ALL)
    np.testing.assert_array_equal(read_bag(tmp_path / "bag").cart, X)


def test_an_array_of_another_length_hides_no_signal(tmp_path: Path) -> None:
    long = np.zeros(5000)
    np.savez(tmp_path / "run.npz", noise=long, t=TIMES, u=0 * X, x=X, theta=TH, drive=long)
    import_csv(tmp_path / "run.npz", tmp_path / "bag", ALL)
    np.testing.assert_array_equal(read_bag(tmp_path / "bag").cart, X)
    with pytest.raises(FileError, match="expected 400 values in drive, as in t, found 5000"):
        import_csv(tmp_path / "run.npz", tmp_path / "no", Columns("t", "drive", "x"))


def test_the_times_of_a_file_to_join_need_that_file(tmp_path: Path) -> None:
    file = write(tmp_path / "file.csv", "t,u,x,theta", TIMES, 0 * X, X, TH)
    columns = Columns("t", "u", "x", "theta", join_time="sent")
    with pytest.raises(WrongUse, match="expected --join FILE beside --join-time, found none"):
        import_csv(file, tmp_path / "bag", columns)


@pytest.mark.parametrize(
    ("sent", "message"),
    [
        ([-7.0, -2.0], "the last 2 s before the first sample"),
        ([9.0, 10.0], "the first 5.01 s after the last sample"),
        ([0.0, 4e15], "4e.15 s in all: give their unit with --time-unit"),
    ],
)
def test_commands_that_were_sent_at_another_time_say_how_far(
    sent: list[float], message: str, tmp_path: Path
) -> None:
    samples = write(tmp_path / "samples.csv", "t,theta", TIMES, TH)
    commands = write(tmp_path / "commands.csv", "t,u,no", np.array(sent), X[:2], np.nan * X[:2])
    columns = Columns("t", "u", pole="theta", join=commands)
    with pytest.raises(FileError, match=message):
        import_csv(samples, tmp_path / "bag", columns)
    with pytest.raises(FileError, match="expected commands, found none"):
        import_csv(samples, tmp_path / "bag", replace(columns, command="no"))


def test_two_files_of_one_name_are_refused_before_any_is_written(tmp_path: Path, capsys) -> None:
    for folder in ("monday", "tuesday"):
        (tmp_path / folder).mkdir()
        write(tmp_path / folder / "run.csv", "t,u,x,theta", TIMES, 0 * X, X, TH)
    files = [str(tmp_path / folder / "run.csv") for folder in ("monday", "tuesday")]
    names = ["--time", "t", "--command", "u", "--cart", "x"]
    assert main(["import", *files, *names, "--out", str(tmp_path / "out")]) == 2
    assert "expected files of different names" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_what_is_printed_of_an_infinite_cell_is_json(tmp_path: Path, capsys) -> None:
    x = X.copy()
    x[7] = np.inf
    file = write(tmp_path / "file.csv", "t,u,x,theta", TIMES, 0 * X, x, TH)
    names = ["--time", "t", "--command", "u", "--cart", "x"]
    assert main(["import", str(file), *names, "--out", str(tmp_path / "bag"), "--json"]) == 0

    def refuse(name: str) -> None:
        raise AssertionError(f"{name} is no JSON")

    said = json.loads(capsys.readouterr().out, parse_constant=refuse)
    assert said["recordings"][0]["ranges"]["cart"][1] < 1.0


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--rate", "-5"), "argument --rate: expected a number above 0, found '-5'"),
        (("--rate", "fast"), "argument --rate: expected a number above 0, found 'fast'"),
        (("--rate", "inf"), "argument --rate: expected a number above 0, found 'inf'"),
        ((), "expected --time COLUMN, or --rate HZ for a file without times, found neither"),
        (("--time", "t", "--rate", "100"), "expected --time COLUMN or --rate HZ, found both"),
        (("--rate", "9", "--command-unit", "V"), "found 'V': leave the option out to keep volts"),
    ],
)
def test_a_wrong_clock_or_unit_is_refused_with_what_to_do(
    options: tuple[str, ...], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(["import", "run.csv", "--out", str(tmp_path / "bag"), "--pole", "theta", *options])
    assert sentence in " ".join(capsys.readouterr().err.split())
