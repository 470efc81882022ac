"""CSV columns become the recording they describe; faults are said in one sentence."""

from pathlib import Path

import numpy as np
import pytest

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.csv_import import Columns, import_csv
from pendulum_sysid.records import Recording
from pendulum_twin.errors import BadInputError

TIMES = 1e9 + np.arange(500) / 125
U, X, TH = (np.sin(k + np.arange(500) / 30) for k in range(3))


def write(
    path: Path, header: str = "t,u,x,theta", separator: str = ",", **changes: np.ndarray
) -> Path:
    columns = {"t": TIMES, "u": U, "x": X, "theta": TH, **changes}
    rows = [
        separator.join(repr(float(v)) for v in row) for row in zip(*columns.values(), strict=True)
    ]
    path.write_text("\n".join([header, *rows, ""]))
    return path


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return write(tmp_path / "file.csv")


def test_columns_become_a_recording(file: Path, tmp_path: Path) -> None:
    import_csv(file, tmp_path / "bag", Columns("t", "u", "x", "theta"))
    raw = read_bag(tmp_path / "bag")
    np.testing.assert_array_equal(raw.command, U)
    np.testing.assert_array_equal(raw.cart, X)
    np.testing.assert_array_equal(raw.pole, TH)
    np.testing.assert_allclose(raw.state_stamp_s, TIMES - 1e9, atol=1e-9)
    np.testing.assert_array_equal(raw.command_stamp_s, raw.state_stamp_s)


def test_signs_and_zero_follow_the_options(file: Path, tmp_path: Path) -> None:
    import_csv(
        file,
        tmp_path / "bag",
        Columns("t", "u", "x", "theta", "down", invert_cart=True, invert_pole=True),
    )
    raw = read_bag(tmp_path / "bag")
    np.testing.assert_array_equal(raw.cart, -X)
    np.testing.assert_array_equal(raw.pole, np.pi - TH)


def test_the_beginning_can_be_skipped(file: Path, tmp_path: Path) -> None:
    import_csv(file, tmp_path / "bag", Columns("t", "u", "x", "theta", skip=0.1))
    raw = read_bag(tmp_path / "bag")
    assert raw.cart is not None
    assert raw.state_stamp_s[0] == 0.0
    assert raw.cart[0] == X[13]


def test_a_pole_alone_needs_no_command_and_a_cart_alone_no_pole(
    file: Path, tmp_path: Path
) -> None:
    import_csv(file, tmp_path / "pole", Columns("t", pole="theta"))
    assert len(read_bag(tmp_path / "pole").command) == 0
    import_csv(file, tmp_path / "cart", Columns("t", "u", "x"))
    assert read_bag(tmp_path / "cart").pole is None


@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_usual_separators_and_a_byte_order_mark_are_read(tmp_path: Path, separator: str) -> None:
    file = write(tmp_path / "file.csv", separator.join(["t", "u", " x ", "theta"]), separator)
    file.write_bytes(b"\xef\xbb\xbf" + file.read_bytes().replace(b"\n", b"\r\n"))
    import_csv(file, tmp_path / "bag", Columns("t", "u", "x", "theta"))
    np.testing.assert_array_equal(read_bag(tmp_path / "bag").cart, X)


def test_a_few_empty_cells_are_missing_values(tmp_path: Path) -> None:
    hole = X.copy()
    hole[[3, 7]] = np.nan
    file = write(tmp_path / "file.csv", x=hole)
    file.write_text(file.read_text().replace("nan", "", 1))
    import_csv(file, tmp_path / "bag", Columns("t", "u", "x"))
    raw = read_bag(tmp_path / "bag")
    assert raw.cart is not None
    assert np.flatnonzero(np.isnan(raw.cart)).tolist() == [3, 7]


def refusal(file: Path, out: Path, *columns: str, **options: object) -> str:
    with pytest.raises(BadInputError) as caught:
        import_csv(file, out, Columns(*columns, **options))
    assert not out.exists()
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


def test_a_missing_column_is_refused_with_those_that_are_there(file: Path, tmp_path: Path) -> None:
    sentence = refusal(file, tmp_path / "bag", "t", "volts", "x")
    assert (
        sentence == f"{file}: expected a column volts, found t, u, x, theta: "
        "name one of these with --command"
    )
    assert "with --time" in refusal(file, tmp_path / "bag", "time", "u", "x")


def test_missing_options_are_refused(file: Path, tmp_path: Path) -> None:
    assert "found neither --cart nor --pole" in refusal(file, tmp_path / "bag", "t", "u")
    assert "name it with --command" in refusal(file, tmp_path / "bag", "t", cart="x", pole="theta")
    assert "expected --pole-zero up or down, found left" in refusal(
        file, tmp_path / "bag", "t", pole="theta", pole_zero="left"
    )


def test_a_cell_that_is_no_number_is_refused_with_its_line(file: Path, tmp_path: Path) -> None:
    lines = file.read_text().splitlines()
    lines[41] = lines[41].replace(repr(float(X[40])), "overrun")
    file.write_text("\n".join(lines))
    sentence = refusal(file, tmp_path / "bag", "t", "u", "x")
    assert "expected a number in line 42 of column x, found 'overrun'" in sentence


def test_files_without_content_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "file.csv"
    assert "cannot be read" in refusal(file, tmp_path / "bag", "t", "u", "x")
    file.write_text("")
    assert "found it empty" in refusal(file, tmp_path / "bag", "t", "u", "x")
    file.write_text("t,u,x\n")
    assert "expected rows of numbers below the header, found none" in refusal(
        file, tmp_path / "bag", "t", "u", "x"
    )
    file.write_text("0,1,2\n1,2,3\n")
    assert "found numbers in line 1" in refusal(file, tmp_path / "bag", "t", "u", "x")
    file.write_bytes(b"t,u,x\n\xff\xfe\n")
    assert "cannot be read" in refusal(file, tmp_path / "bag", "t", "u", "x")


def test_times_must_be_there_and_rise(tmp_path: Path) -> None:
    times = np.round(TIMES - 1e9, 6)
    times[250:] -= 1
    sentence = refusal(write(tmp_path / "a.csv", t=times), tmp_path / "bag", "t", "u", "x")
    assert "expected times that rise in column t, found 1 after 1.992 in line 252" in sentence
    times = TIMES.copy()
    times[9] = np.nan
    assert "found none in line 11" in refusal(
        write(tmp_path / "b.csv", t=times), tmp_path / "bag", "t", "u", "x"
    )


def test_too_many_missing_values_are_refused(tmp_path: Path) -> None:
    hole = X.copy()
    hole[:40] = np.nan
    sentence = refusal(write(tmp_path / "file.csv", x=hole), tmp_path / "bag", "t", "u", "x")
    assert "found 40 of 500 cells empty, nan or infinite" in sentence


def test_skipping_everything_is_refused(file: Path, tmp_path: Path) -> None:
    assert "found only 3.992 s in all: skip less" in refusal(
        file, tmp_path / "bag", "t", "u", "x", skip=5.0
    )


def test_nothing_is_overwritten(file: Path, tmp_path: Path) -> None:
    (tmp_path / "bag").mkdir()
    with pytest.raises(BadInputError, match="found it there already"):
        import_csv(file, tmp_path / "bag", Columns("t", "u", "x"))


# Real rigs


def imported(file: Path, tmp_path: Path, *columns: str, **options: object) -> Recording:
    import_csv(file, tmp_path / "bag", Columns("t", *columns, **options))
    return clean_recording(read_bag(tmp_path / "bag"))


def intervals(recording: Recording) -> dict[str, tuple[tuple[float, float], ...]]:
    return {f.kind: f.intervals_s for f in recording.findings}


@pytest.mark.parametrize("run", range(5))
def test_the_chirps_of_a_real_cart_have_their_first_and_last_sample_marked(
    shared_data: Path, tmp_path: Path, run: int
) -> None:
    file = sorted((shared_data / "quanser_cartpole" / "chirp").glob("*.csv"))[run]
    out = imported(file, tmp_path, "u_applied", "x", "theta", pole_zero="down")
    assert intervals(out) == {
        "gap": ((5.5, 5.5),),
        "spike": ((0.0, 0.0), (5.5, 5.5)),
    }  # the last command is empty
    assert out.signals.stretch_begins == (0,)
    assert out.signals.cart_valid[1:-1].all()
    assert out.signals.pole_valid[:-1].all()
    assert out.signals.period_s == 0.004


@pytest.mark.parametrize(("run", "wraps"), [(0, 5), (1, 6)])
def test_the_swing_ups_of_a_real_cart_are_unwrapped(
    shared_data: Path, tmp_path: Path, run: int, wraps: int
) -> None:
    file = sorted((shared_data / "quanser_cartpole" / "swing_up").glob("*.csv"))[run]
    out = imported(file, tmp_path, "u_applied", "x", "theta", pole_zero="down")
    assert intervals(out)["spike"] == ((0.0, 0.0),)
    assert len(intervals(out)["wrap"]) == wraps
    assert out.signals.pole is not None
    assert np.abs(np.diff(out.signals.pole)).max() < 0.06


def test_a_real_cart_alone_has_no_faults(shared_data: Path, tmp_path: Path) -> None:
    out = imported(shared_data / "emps" / "emps_estimation.csv", tmp_path, "vir", "qm")
    assert out.findings == ()
    assert (len(out.signals), out.signals.period_s, out.signals.pole) == (24841, 0.001, None)
    assert out.signals.cart_valid.all()


def test_a_real_pole_alone_has_no_faults(shared_data: Path, tmp_path: Path) -> None:
    out = imported(
        shared_data / "multiarm_free_swing" / "single_free_swing_id.csv", tmp_path, pole="theta"
    )
    assert out.findings == ()
    assert (len(out.signals), out.signals.period_s, out.signals.cart) == (36668, 0.001, None)
    assert out.signals.pole_valid.all()
