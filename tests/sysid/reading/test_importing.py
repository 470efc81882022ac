"""CSV columns become the recording they describe; faults are said in one sentence."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.columns import COMMAND_UNITS, Columns
from pendulum_sysid.reading.csv_import import import_csv
from pendulum_sysid.reading.raw import RawRecording
from pendulum_sysid.records import Recording
from pendulum_sysid.verbs import import_options
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


@pytest.mark.parametrize(
    ("key", "expected"),
    [
        ("pole_zero", "--pole-zero up or down"),
        ("length_unit", "--length-unit m, cm or mm"),
        ("angle_unit", "--angle-unit rad, deg or turn"),
        ("time_unit", "--time-unit s, ms, us or ns"),
        ("command_unit", "--command-unit one, percent or per_mille"),
        ("command_acts", "--command-acts after or before"),
    ],
)
def test_a_choice_that_is_none_is_refused(
    file: Path, tmp_path: Path, key: str, expected: str
) -> None:
    """From Python as from the shell, where the command line refuses it."""
    sentence = refusal(file, tmp_path / "bag", "t", "u", "x", "theta", **{key: "inch"})
    assert f"expected {expected}, found inch" in sentence


def test_a_cell_that_is_no_number_is_refused_with_its_line(file: Path, tmp_path: Path) -> None:
    lines = file.read_text().splitlines()
    lines[41] = lines[41].replace(repr(float(X[40])), "overrun")
    file.write_text("\n".join(lines))
    sentence = refusal(file, tmp_path / "bag", "t", "u", "x")
    assert "expected a number in line 42 of column x, found 'overrun'" in sentence


def test_files_without_content_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "file.csv"
    assert "cannot be read: no such file" in refusal(file, tmp_path / "bag", "t", "u", "x")
    file.write_text("")
    assert "found it empty" in refusal(file, tmp_path / "bag", "t", "u", "x")
    file.write_text("t,u,x\n")
    assert "expected rows of numbers below the header, found none" in refusal(
        file, tmp_path / "bag", "t", "u", "x"
    )
    file.write_text("0,1,2\n1,2,3\n")
    assert "3 names, t among them, found none in line 1" in refusal(
        file, tmp_path / "bag", "t", "u", "x"
    )
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


# Files as laboratories write them


def import_file(file: Path, *columns: str, **options: object) -> RawRecording:
    out = file.parent / f"{file.name}.bag"
    import_csv(file, out, Columns(*columns, **options))
    return read_bag(out)


def write_rows(path: Path, *above: str, separator: str = ",", comma: bool = False) -> Path:
    rows = [
        separator.join(f"{v:.9f}" for v in row) for row in zip(TIMES - 1e9, U, X, TH, strict=True)
    ]
    text = "\n".join([*above, *rows, ""])
    path.write_text(text.replace(".", ",") if comma else text)
    return path


UNITS = [
    ("x", X, 1e2, {"length_unit": "cm"}),
    ("x", X, 1e3, {"length_unit": "mm"}),
    ("theta", TH, 180 / np.pi, {"angle_unit": "deg"}),
    ("theta", TH, 0.5 / np.pi, {"angle_unit": "turn"}),
    ("u", U, 1e2, {"command_unit": "percent"}),
    ("u", U, 1e3, {"command_unit": "per_mille"}),
    ("t", TIMES - 1e9, 1e3, {"time_unit": "ms"}),
    ("t", TIMES - 1e9, 1e6, {"time_unit": "us"}),
    ("t", TIMES, 1e9, {"time_unit": "ns"}),
]


@pytest.mark.parametrize(("column", "values", "factor", "options"), UNITS)
def test_units_become_si(
    tmp_path: Path, column: str, values: np.ndarray, factor: float, options: dict[str, str]
) -> None:
    file = write(tmp_path / "file.csv", **{column: factor * values})
    raw = import_file(file, "t", "u", "x", "theta", **options)
    np.testing.assert_allclose(raw.command, U, atol=1e-12)
    np.testing.assert_allclose(raw.cart, X, atol=1e-12)
    np.testing.assert_allclose(raw.pole, TH, atol=1e-12)
    np.testing.assert_allclose(raw.state_stamp_s, TIMES - 1e9, atol=1e-6)


@pytest.mark.parametrize("factor", [1.0, 1e3, 1e6, 1e9])
def test_times_since_1970_are_understood(tmp_path: Path, factor: float) -> None:
    file = write(tmp_path / "file.csv", t=factor * (TIMES + 7e8))
    raw = import_file(file, "t", "u", "x")
    np.testing.assert_allclose(raw.state_stamp_s, TIMES - 1e9, atol=1e-6)


def test_times_longer_than_a_stamp_holds_are_refused(tmp_path: Path) -> None:
    file = write(tmp_path / "file.csv", t=(TIMES - 1e9) * 1e9)
    assert "found 3.99e+09 s in all: give their unit with --time-unit" in refusal(
        file, tmp_path / "bag", "t", "u", "x"
    )


def test_rows_without_times_have_a_rate(file: Path) -> None:
    raw = import_file(file, command="u", cart="x", rate_hz=125.0)
    np.testing.assert_allclose(raw.state_stamp_s, np.arange(500) / 125.0, atol=1e-9)


def test_a_file_has_times_or_a_rate(file: Path, tmp_path: Path) -> None:
    assert "found neither: say when" in refusal(file, tmp_path / "bag", None, "u", "x")
    assert "found both: leave out" in refusal(file, tmp_path / "bag", "t", "u", "x", rate_hz=9.0)


@pytest.mark.parametrize("numbers", [("#1", "#2", "#3", "#4"), ("1", "2", "3", "4")])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_columns_are_taken_by_number_without_a_header(
    tmp_path: Path, numbers: tuple[str, ...], separator: str
) -> None:
    raw = import_file(write_rows(tmp_path / "f.csv", separator=separator), *numbers)
    np.testing.assert_allclose(raw.cart, X, atol=1e-9)
    np.testing.assert_allclose(raw.pole, TH, atol=1e-9)


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("header", [(), ("t{0}u{0}x{0}theta",)])
def test_decimal_commas_are_read(tmp_path: Path, separator: str, header: tuple[str, ...]) -> None:
    above = [line.format(separator) for line in header]
    file = write_rows(tmp_path / "f.csv", *above, separator=separator, comma=True)
    raw = import_file(file, "#1", "#2", "#3", "#4")
    np.testing.assert_allclose(raw.cart, X, atol=1e-9)


@pytest.mark.parametrize(
    "above",
    [
        ("# saved by hand", "# on a Monday, with care", "t,u,x,theta"),
        ("# saved by hand", "# t,u,x,theta"),
        ("% saved by hand", "", "t,u,x,theta", "[s],[V],[m],[rad]"),
    ],
)
def test_comments_and_a_line_of_units_are_left_out(tmp_path: Path, above: tuple[str, ...]) -> None:
    raw = import_file(write_rows(tmp_path / "f.csv", *above), "t", "u", "x", "theta")
    assert len(raw.state_stamp_s) == 500
    np.testing.assert_allclose(raw.cart, X, atol=1e-9)


def test_a_number_beyond_the_columns_is_refused(tmp_path: Path) -> None:
    file = write_rows(tmp_path / "f.csv")
    assert "give --cart the number of a column, 1 to 4" in refusal(
        file, tmp_path / "bag", "#1", "#2", "#5"
    )


def test_sine_and_cosine_make_the_angle(tmp_path: Path) -> None:
    file = write(tmp_path / "file.csv", "t,s,c,theta", u=np.sin(TH), x=np.cos(TH), theta=0 * TH)
    raw = import_file(file, "t", sin="s", cos="c", pole_zero="down", invert_pole=True)
    np.testing.assert_allclose(raw.pole, np.pi - TH, atol=1e-12)
    assert "--sin and --cos together" in refusal(file, tmp_path / "bag", "t", sin="s")


def test_velocities_follow_signs_and_units(file: Path, tmp_path: Path) -> None:
    raw = import_file(
        file,
        "t",
        "u",
        "x",
        "theta",
        invert_cart=True,
        length_unit="mm",
        angle_unit="deg",
        cart_velocity="x",
        pole_velocity="theta",
    )
    np.testing.assert_allclose(raw.cart_velocity, -1e-3 * X)
    np.testing.assert_allclose(raw.pole_velocity, np.radians(TH))
    assert "expected a position beside every velocity" in refusal(
        file, tmp_path / "bag", "t", pole="theta", cart_velocity="x"
    )


def test_the_velocity_of_one_joint_leaves_the_other_without(file: Path) -> None:
    raw = import_file(file, "t", "u", "x", "theta", pole_velocity="theta")
    assert raw.cart_velocity is None
    np.testing.assert_array_equal(raw.pole_velocity, TH)


def test_the_command_before_the_positions_of_a_row_acts_from_the_row_before(file: Path) -> None:
    raw = import_file(file, "t", "u", "x", command_acts="before")
    np.testing.assert_array_equal(raw.command, [*U[1:], U[-1]])


def test_commands_of_another_file_say_when_they_act(file: Path, tmp_path: Path) -> None:
    sentence = refusal(file, tmp_path / "bag", "t", "u", "x", join=file, command_acts="before")
    assert "found --join" in sentence


def test_matlab_and_numpy_files_are_read(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", t=TIMES - 1e9, u=U, y=np.column_stack([X, TH]), note="mine")
    raw = import_file(tmp_path / "run.npz", "t", "u", "y[1]", "y[2]")
    np.testing.assert_array_equal(raw.pole, TH)
    log = {"x": X[:, None], "theta": TH}
    savemat(tmp_path / "run.mat", {"t": TIMES - 1e9, "u": U, "log": log, "Ts": 0.008})
    raw = import_file(tmp_path / "run.mat", "t", "u", "log.x", "log.theta")
    np.testing.assert_array_equal(raw.cart, X)


@pytest.mark.parametrize("suffix", [".npz", ".mat", ".parquet"])
def test_damaged_files_of_arrays_are_refused(tmp_path: Path, suffix: str) -> None:
    file = tmp_path / f"run{suffix}"
    file.write_bytes(b"no arrays at all")
    assert ": expected " in refusal(file, tmp_path / "bag", "t", "u", "x")


def test_code_in_a_numpy_file_is_not_run(tmp_path: Path) -> None:
    np.savez(tmp_path / "run.npz", t=np.array([print], dtype=object))
    assert "cannot be read" in refusal(tmp_path / "run.npz", tmp_path / "bag", "t", pole="t")


def test_a_recording_needs_no_import(file: Path, tmp_path: Path) -> None:
    import_file(file, "t", "u", "x")
    sentence = refusal(tmp_path / "file.csv.bag", tmp_path / "bag", "t", "u", "x")
    assert "found a recording: nothing is to be imported, give it to sysid diagnose" in sentence


def test_a_folder_without_a_recording_is_no_file(tmp_path: Path) -> None:
    folder = tmp_path / "runs"
    folder.mkdir()
    (folder / "monday.csv").write_text("t,u,x\n")
    sentence = refusal(folder, tmp_path / "bag", "t", "u", "x")
    assert sentence.endswith("file, found a folder: name the files in it")


def test_a_csv_file_in_place_of_a_recording_names_the_import(file: Path) -> None:
    with pytest.raises(BadInputError, match=r"found file\.csv: turn it .* with sysid import"):
        read_bag(file)


def test_an_import_says_what_it_read(file: Path, tmp_path: Path) -> None:
    imported = import_csv(
        file, tmp_path / "bag", Columns("t", "u", "x", "theta", "down", skip=1.0)
    )
    assert imported.rows == 375
    assert imported.seconds == pytest.approx(2.992)
    assert imported.rate_hz == pytest.approx(125.0)
    assert list(imported.ranges) == ["command", "cart", "pole"]
    assert imported.ranges["cart"] == (X[125:].min(), X[125:].max())
    assert imported.begins_at_rad == pytest.approx(np.pi + TH[128])


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


def test_the_log_of_a_real_rig_with_comments_is_read_as_it_is(
    shared_data: Path, tmp_path: Path
) -> None:
    file = sorted((shared_data / "sensorsini_cartpole" / "v1").glob("*.csv"))[0]
    import_csv(file, tmp_path / "bag", Columns("time", "Q", "position", "angle"))
    sines = Columns("time", "Q", "position", sin="angle_sin", cos="angle_cos")
    import_csv(file, tmp_path / "sines", sines)
    angles = [read_bag(tmp_path / name).pole for name in ("bag", "sines")]
    np.testing.assert_allclose(*angles, atol=1e-9)


def test_the_units_that_the_option_offers_are_those_that_are_read() -> None:
    assert tuple(COMMAND_UNITS) == import_options.COMMAND_UNITS
