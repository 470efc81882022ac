"""Recovering without ROS: what is kept, what is said, what is refused."""

import shutil
import struct
from pathlib import Path

import pytest
from support.recorder_bags import counts, data_file, index, with_rosbags

from pendulum_bridge.recording.recover import recover
from pendulum_bridge.recording.recover_command import run_recover
from pendulum_twin.bags.bag import Bag
from pendulum_twin.bags.metadata import INDEX
from pendulum_twin.bags.records import Message, Topic
from pendulum_twin.errors import BadInputError

COMMANDS = Topic("/rig/pwm", "std_msgs/msg/Float64", "float64 data\n")


def written(folder: Path, closed: bool = False, **options) -> Path:
    """Write 40 commands in four chunks; close the folder, or leave it as after a kill."""
    bag = Bag(folder, started_ns=1, custom={"note": "mine"}, **options)
    bag.add_topic(COMMANDS)
    for k in range(40):
        data = struct.pack("<4Bd", 0, 1, 0, 0, k)
        bag.keep(Message("/rig/pwm", 10**18 + k * 10**7, 10**18 + k, k + 1, data))
        if k % 10 == 9:
            bag.flush()
    if closed:
        bag.close()
    return folder


def cut(folder: Path, size: int) -> None:
    with data_file(folder).open("r+b") as stream:
        stream.truncate(size)


def values(folder: Path) -> list[float]:
    return [message.decoded.data for message in with_rosbags(folder)]


def test_a_file_without_its_end_is_made_whole(tmp_path: Path) -> None:
    recovered = recover(written(tmp_path / "run"))
    assert recovered.folder == tmp_path / "run_recovered" and values(recovered.folder) == list(
        range(40)
    )
    assert (
        "kept 40 messages over 0.39 s (/rig/pwm 40); run_0.mcap had no end mark"
        in recovered.sentence
    )
    kept = index(recovered.folder)["custom_data"]
    assert (
        kept["note"] == "mine"
        and kept["recovered_from"].startswith("run_0.mcap sha256:")
        and kept["recovered"]
    )


def test_a_chunk_that_was_cut_gives_what_is_there(tmp_path: Path) -> None:
    folder = written(tmp_path / "run")
    size = data_file(folder).stat().st_size
    cut(folder, size - 400)  # behind the chunk stands an index of 180 bytes
    recovered = recover(folder)
    assert 30 < counts(recovered.folder)["/rig/pwm"] < 40
    assert values(recovered.folder) == list(range(counts(recovered.folder)["/rig/pwm"]))
    assert (
        "lost" in recovered.sentence
        and f"of which {len(values(recovered.folder)) - 30} messages were saved"
        in recovered.sentence
    )


def test_a_damaged_chunk_is_left_out_and_said(tmp_path: Path) -> None:
    folder = written(tmp_path / "run", closed=True)
    content = bytearray(data_file(folder).read_bytes())
    content[content.index(struct.pack("<d", 15.0))] ^= 1
    data_file(folder).write_bytes(content)
    recovered = recover(folder)
    assert values(recovered.folder) == [*range(10), *range(20, 40)]
    assert "bytes of run_0.mcap that were cut or damaged" in recovered.sentence


def test_zeros_after_a_power_cut_end_the_file(tmp_path: Path) -> None:
    folder = written(tmp_path / "run")
    with data_file(folder).open("ab") as stream:
        stream.write(bytes(5000))
    recovered = recover(folder)
    assert values(recovered.folder) == list(range(40)) and "lost 5000 bytes" in recovered.sentence


@pytest.mark.parametrize("index_text", [None, "", "rosbag2_bagfile_information:\n  - [", "[]\n"])
def test_an_index_that_is_missing_or_damaged_is_made_anew(
    tmp_path: Path, index_text: str | None
) -> None:
    folder = written(tmp_path / "run", closed=True)
    (folder / INDEX).unlink() if index_text is None else (folder / INDEX).write_text(index_text)
    recovered = recover(folder)
    assert (
        values(recovered.folder) == list(range(40))
        and f"{INDEX} was missing or unreadable" in recovered.sentence
    )
    assert index(recovered.folder)["custom_data"]["note"] == "mine"  # the data file knows it too


def test_an_old_index_is_brought_up_to_date(tmp_path: Path) -> None:
    folder = written(tmp_path / "run")
    old = (folder / INDEX).read_text()
    shutil.rmtree(folder)
    written(folder, closed=True)
    (folder / INDEX).write_text(old)
    recovered = recover(folder)
    assert (
        counts(recovered.folder) == {"/rig/pwm": 40}
        and "nothing was lost but a right metadata.yaml" in recovered.sentence
    )


def test_a_data_file_alone_is_enough(tmp_path: Path) -> None:
    shutil.copy(data_file(written(tmp_path / "run")), tmp_path / "alone.mcap")
    recovered = recover(tmp_path / "alone.mcap")
    assert recovered.folder == tmp_path / "alone_recovered" and values(recovered.folder) == list(
        range(40)
    )
    assert index(recovered.folder)["custom_data"]["note"] == "mine"


def test_the_data_file_of_a_folder_stands_for_the_folder(tmp_path: Path) -> None:
    folder = written(tmp_path / "run")
    assert recover(data_file(folder)).folder == tmp_path / "run_recovered"


def test_a_bag_of_several_files_becomes_one(tmp_path: Path) -> None:
    folder = written(tmp_path / "run")
    for name in ("run_10.mcap", "run_2.mcap"):
        shutil.copy(data_file(folder), folder / name)
    assert counts(recover(folder).folder) == {"/rig/pwm": 120}


def test_a_whole_bag_needs_nothing(tmp_path: Path, capsys: pytest.CaptureFixture) -> None:
    folder = written(tmp_path / "run", closed=True)
    assert run_recover(["--recover", str(folder)]) == 0
    assert "is whole: 40 messages" in capsys.readouterr().out
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


def test_nothing_is_overwritten(tmp_path: Path) -> None:
    folder = written(tmp_path / "run")
    recover(folder)
    with pytest.raises(BadInputError, match="recordings are not overwritten"):
        recover(folder)


@pytest.mark.parametrize(
    "make", ["nothing", "empty folder", "empty file", "no message", "no mcap"]
)
def test_what_cannot_be_recovered_is_refused(
    tmp_path: Path, make: str, capsys: pytest.CaptureFixture
) -> None:
    path = tmp_path / "run"
    if make == "empty folder":
        path.mkdir()
    elif make == "empty file":
        path = tmp_path / "run.mcap"
        path.write_bytes(b"")
    elif make == "no message":
        Bag(path)
    elif make == "no mcap":
        path = tmp_path / "run.mcap"
        path.write_bytes(b"SQLite format 3\0")
    assert run_recover(["--recover", str(path)]) == 1
    said = capsys.readouterr().err
    assert said.startswith("recorder_node: ") and "expected" in said and said.count("\n") == 1
