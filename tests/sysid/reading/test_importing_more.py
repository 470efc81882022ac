"""Files that hold several runs, two files of one run, MATLAB 7.3, bags of ROS 1."""

from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag1 import Writer
from rosbags.typesys import Stores, get_typestore
from support.paths import CONFIG

from pendulum_sysid.cli import main
from pendulum_sysid.errors import FileError, WrongUse
from pendulum_sysid.reading.bag import read_bag
from pendulum_sysid.reading.columns import Columns
from pendulum_sysid.reading.csv_import import import_csv, import_segments

TIMES = np.arange(400) / 100
X, TH = np.sin(TIMES), np.cos(TIMES)
ALL = Columns("t", "u", "x", "theta")


def write(path: Path, **columns: np.ndarray) -> Path:
    rows = [",".join(map(repr, map(float, row))) for row in zip(*columns.values(), strict=True)]
    path.write_text("\n".join([",".join(columns), *rows, ""]))
    return path


def test_every_run_of_a_file_becomes_a_recording(tmp_path: Path) -> None:
    run = np.repeat([3.0, 1.0, 3.0], [150, 150, 100])
    begins = np.repeat([0.0, 1.5, 3.0], [150, 150, 100])
    file = write(tmp_path / "runs.csv", t=TIMES - begins, u=0 * X, x=X, theta=TH, run=run)
    columns = Columns("t", "u", "x", "theta", segment="run")
    imported = import_segments(file, tmp_path / "out", columns)
    assert [path.name for path in imported] == ["3", "1", "3_line_302"]
    assert [i.rows for i in imported.values()] == [150, 150, 100]
    np.testing.assert_array_equal(read_bag(tmp_path / "out" / "1").cart, X[150:300])
    with pytest.raises(FileError, match="with --segment"):
        import_csv(file, tmp_path / "whole", ALL)


def test_rows_that_belong_to_no_run_are_left_out(tmp_path: Path) -> None:
    run = np.repeat([1.0, np.nan], [300, 100])
    file = write(tmp_path / "runs.csv", t=TIMES, u=0 * X, x=X, theta=TH, run=run)
    columns = Columns("t", "u", "x", "theta", segment="run")
    assert [i.rows for i in import_segments(file, tmp_path / "out", columns).values()] == [300]


def test_a_run_that_cannot_be_read_leaves_nothing_behind(tmp_path: Path) -> None:
    run = np.repeat([1.0, 2.0], [399, 1])  # the second run has a single row
    file = write(tmp_path / "runs.csv", t=TIMES, u=0 * X, x=X, theta=TH, run=run)
    columns = Columns("t", "u", "x", "theta", segment="run")
    with pytest.raises(FileError, match="expected rows"):
        import_segments(file, tmp_path / "out", columns)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("epoch_s", [0.0, 1.7e9])
def test_commands_may_stand_in_another_file(epoch_s: float, tmp_path: Path) -> None:
    """The command before the first sample holds when the samples begin."""
    sent = np.array([-0.7, -0.2, 0.5, 1.25, 9.0])
    state = write(tmp_path / "state.csv", t=TIMES + epoch_s, x=X, theta=TH)
    command = write(tmp_path / "command.csv", sent=sent + epoch_s, u=np.arange(5) / 10)
    columns = Columns("t", "u", "x", "theta", join=command, join_time="sent")
    import_csv(state, tmp_path / "bag", columns)
    raw = read_bag(tmp_path / "bag")
    np.testing.assert_allclose(raw.command_stamp_s, [0.0, 0.5, 1.25], atol=1e-6)
    np.testing.assert_array_equal(raw.command, [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(raw.pole, TH)


def test_files_of_two_clocks_are_refused(tmp_path: Path) -> None:
    state = write(tmp_path / "state.csv", t=TIMES, x=X, theta=TH)
    command = write(tmp_path / "command.csv", t=TIMES + 100.0, u=X)
    columns = Columns("t", "u", "x", "theta", join=command)
    with pytest.raises(FileError, match=r"the first 96.01 s after the last sample.*one clock"):
        import_csv(state, tmp_path / "bag", columns)
    with pytest.raises(WrongUse, match="--time and --command beside --join"):
        import_csv(state, tmp_path / "bag", Columns(None, "u", "x", rate_hz=100.0, join=command))
    assert not (tmp_path / "bag").exists()


def test_the_columns_of_matlab_7_3(tmp_path: Path) -> None:
    """MATLAB writes a vector as a matrix of one row, its axes in reverse, and a group a struct."""
    h5py = pytest.importorskip("h5py")
    with h5py.File(tmp_path / "log.mat", "w", userblock_size=512) as file:
        file["t"], file["u"] = TIMES[:, None], np.zeros((1, 400))
        file["log/x"], file["theta"] = X[None], np.column_stack([TH, TH]).T
        file["#refs#/a"] = np.zeros((3, 3))
    import_csv(tmp_path / "log.mat", tmp_path / "bag", Columns("t", "u", "log.x", "theta[2]"))
    raw = read_bag(tmp_path / "bag")
    np.testing.assert_array_equal(raw.cart, X)
    np.testing.assert_array_equal(raw.pole, TH)


def write_ros1_bag(path: Path) -> Path:
    store = get_typestore(Stores.ROS1_NOETIC)
    joints, pwm, header = (
        store.types[f"{name}"]
        for name in ("sensor_msgs/msg/JointState", "std_msgs/msg/Float64", "std_msgs/msg/Header")
    )
    stamp = store.types["builtin_interfaces/msg/Time"]
    with Writer(path) as bag:
        states = bag.add_connection("/joint_states", joints.__msgtype__, typestore=store)
        commands = bag.add_connection("/pwm", pwm.__msgtype__, typestore=store)
        for k, (x, th) in enumerate(zip(X, TH, strict=True)):
            at = 1_700_000_000_000_000_000 + 10_000_000 * k
            begin = header(k, stamp(at // 10**9, at % 10**9), "")
            names, numbers = ["cart", "pole"], np.array([x, th])
            message = joints(begin, names, numbers, 0 * numbers, np.zeros(0))
            bag.write(states, at, store.serialize_ros1(message, joints.__msgtype__))
            bag.write(commands, at, store.serialize_ros1(pwm(0.01 * k), pwm.__msgtype__))
    return path


def test_a_bag_of_ros_1_becomes_a_recording(tmp_path: Path, capsys) -> None:
    bag = write_ros1_bag(tmp_path / "old.bag")
    assert main(["import", str(bag), "--out", str(tmp_path / "new")]) == 0
    said = capsys.readouterr().out
    assert "/joint_states sensor_msgs/msg/JointState 400" in said and "/pwm" in said
    raw = read_bag(tmp_path / "new", state_topic="/joint_states", command_topic="/pwm")
    np.testing.assert_array_equal(raw.cart, X)
    np.testing.assert_allclose(raw.state_stamp_s, TIMES, atol=1e-6)
    np.testing.assert_allclose(raw.command, 0.01 * np.arange(400))


def test_what_is_no_bag_of_ros_1_is_refused_and_nothing_is_left(tmp_path: Path, capsys) -> None:
    (tmp_path / "old.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(100))
    assert main(["import", str(tmp_path / "old.bag"), "--out", str(tmp_path / "new")]) == 1
    assert "expected a bag of ROS 1" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["old.bag"]
    bag = write_ros1_bag(tmp_path / "whole.bag")
    assert main(["import", str(bag), "--out", str(tmp_path / "old.bag" / "new")]) == 1
    said = capsys.readouterr().err
    assert f"{tmp_path / 'old.bag' / 'new'}: expected a place to write to" in said
    assert "rosbag info" not in said
    table = write(tmp_path / "file.csv", t=TIMES, x=X)
    mixed = ["import", str(tmp_path / "old.bag"), str(table), "--time", "t", "--cart", "x"]
    assert main([*mixed, "--command", "x", "--out", str(tmp_path / "both")]) == 1
    assert "found a bag of ROS 1" in capsys.readouterr().err
    assert main(["check", str(tmp_path / "old.bag"), "--twin", str(CONFIG / "inteco.yaml")]) == 1
    assert "sysid import" in capsys.readouterr().err
