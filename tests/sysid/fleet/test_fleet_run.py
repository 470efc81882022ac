"""`sysid fleet run`: what is found, broken, killed and gone on with; folders on disk and on S3."""

import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

import pandas as pd
import pyarrow.fs
import pytest
from support.fleet_rows import examine_growing, examine_or_die, write_fleet

from pendulum_sysid.cli import main
from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet import engine as engine_module
from pendulum_sysid.fleet import run as run_module
from pendulum_sysid.fleet.places import Place
from pendulum_sysid.fleet.recordings import find_sources
from pendulum_sysid.fleet.store import Store

DEADLINE_S = 240.0
# where the number of workers shows nothing: each takes seconds to start
ALONE = ("--workers", "1")
BY_CHANCE = ["written_at", "batch", "cpu_s"]  # columns that differ from run to run


@pytest.fixture(scope="session")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six recordings of two rigs: two of them broken, one cut off near its end."""
    folder = tmp_path_factory.mktemp("fleet")
    write_fleet(folder)
    next((folder / "data" / "rig_0" / "002").glob("*.mcap")).write_bytes(b"no recording")
    next((folder / "data" / "rig_1" / "003").glob("*.mcap")).unlink()
    cut = next((folder / "data" / "rig_1" / "005").glob("*.mcap"))
    cut.write_bytes(cut.read_bytes()[: cut.stat().st_size * 9 // 10])
    return folder


@pytest.fixture(scope="session")
def whole(fleet: Path) -> pd.DataFrame:
    """The rows of an undisturbed run."""
    store = fleet / "store"
    assert run(fleet, store) == 0
    return read(store)


def run(fleet: Path, store: object, *more: str) -> int:
    table = str(fleet / "table.yaml")
    return main(["fleet", "run", str(fleet / "data"), "--twins", table, "--store", str(store),
                 "--method", "fit", *more])  # fmt: skip


def read(store: object) -> pd.DataFrame:
    frame = Store(str(store)).read_recordings()
    return frame.drop(columns=BY_CHANCE)


def test_broken_recordings_are_told_and_stop_nothing(fleet: Path, whole, capsys) -> None:
    outcomes = dict(zip(whole["path"].map(lambda p: p[-3:]), whole["outcome"], strict=True))
    assert outcomes == {
        "000": "fitted", "001": "fitted", "002": "unusable", "003": "unusable", "004": "fitted",
        "005": "fitted",
    }  # fmt: skip
    sentence = whole.loc[whole["path"].str.endswith("003"), "sentence"].iloc[0]
    assert "without its data files" in sentence
    sentence = whole.loc[whole["path"].str.endswith("005"), "sentence"].iloc[0]
    assert "not whole" in sentence and "the file ends before its end mark" in sentence
    sizes = Store(str(fleet / "store")).read_sizes()
    friction = sizes[sizes["parameter"] == "cart_viscous_n_s_m"]
    assert len(friction) == 4 and set(friction["unit"]) == {"N s/m"}
    assert ((friction["low"] < 0.5) & (friction["high"] > 0.5)).sum() >= 3


def test_running_twice_changes_nothing(fleet: Path, whole, capsys) -> None:
    files = Place(str(fleet / "store")).list_files()
    assert run(fleet, fleet / "store") == 0
    assert "6 known, 0 examined" in capsys.readouterr().out
    assert Place(str(fleet / "store")).list_files() == files


def test_a_killed_coordinator_is_gone_on_from(fleet: Path, whole, tmp_path: Path) -> None:
    store = tmp_path / "store"
    command = [sys.executable, "-m", "pendulum_sysid.cli", "fleet", "run", str(fleet / "data")]
    command += ["--twins", str(fleet / "table.yaml"), "--store", str(store), "--method", "fit"]
    with subprocess.Popen(
        [*command, *ALONE], stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}, start_new_session=True,
    ) as program:  # fmt: skip
        assert program.stderr is not None
        line = program.stderr.readline()
        os.killpg(program.pid, signal.SIGKILL)
    assert "/6 rig_" in line or "unusable" in line
    assert run(fleet, store, *ALONE) == 0
    pd.testing.assert_frame_equal(read(store), whole)


@pytest.mark.long
def test_a_recording_that_ends_its_worker_is_put_aside_and_tried_by_the_next_run(
    fleet: Path, whole, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.setattr(run_module, "examine_recording", examine_or_die)
    assert run(fleet, tmp_path / "store", *ALONE) == 0
    told = capsys.readouterr()
    assert "6 examined, 3 of them without an answer" in told.out
    assert "000: put_aside: its worker died twice" in told.err
    monkeypatch.undo()
    assert run(fleet, tmp_path / "store", *ALONE) == 0
    assert "5 known, 1 examined, 0 of them" in capsys.readouterr().out
    pd.testing.assert_frame_equal(read(tmp_path / "store"), whole)


def test_the_store_may_be_on_s3(fleet: Path, whole, monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings and store on a server that answers by S3's protocol; the workers use it too."""
    server_module = pytest.importorskip("moto.server")
    server = server_module.ThreadedMotoServer(ip_address="127.0.0.1", port=0, verbose=False)
    server.start()
    try:
        host, port = server.get_host_and_port()
        address = f"http://{host}:{port}"
        for name, value in (
            ("AWS_ENDPOINT_URL", address), ("AWS_ACCESS_KEY_ID", "a"),
            ("AWS_SECRET_ACCESS_KEY", "b"), ("AWS_REGION", "us-east-1"),
            ("AWS_DEFAULT_REGION", "us-east-1"),
        ):  # fmt: skip
            monkeypatch.setenv(name, value)
        bucket = pyarrow.fs.S3FileSystem(endpoint_override=address, allow_bucket_creation=True)
        bucket.create_dir("bench")
        data = Place("s3://bench/data")
        for file in sorted((fleet / "data" / "rig_0").rglob("*")):
            if file.is_file():
                data.write(str(file.relative_to(fleet / "data")), file.read_bytes())
        table = str(fleet / "table.yaml")
        words = ["fleet", "run", "s3://bench/data", "--twins", table, "--method", "fit", *ALONE]
        assert main([*words, "--store", "s3://bench/store"]) == 0
        assert main([*words, "--store", "s3://bench/store"]) == 0
        rows = read("s3://bench/store").drop(columns="path")
    finally:
        server.stop()
    expected = whole[whole["rig"] == "rig_0"].drop(columns="path").reset_index(drop=True)
    bad = expected["outcome"] == "unusable"  # its sentence and time name a copy
    pd.testing.assert_frame_equal(rows[~bad], expected[~bad])
    assert list(rows["outcome"]) == list(expected["outcome"])


def test_bad_input_is_told_in_a_sentence(
    fleet: Path, tmp_path: Path, capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engine_module, "CONNECT_S", 1.0)
    data, table = str(fleet / "data"), str(fleet / "table.yaml")
    missing = tmp_path / "missing.yaml"
    missing.write_text("schema: pendulum_fleet/1\nrigs: {rig_0: {twin: nowhere.yaml}}\n")
    none = tmp_path / "none.yaml"
    none.write_text(f"schema: pendulum_fleet/1\nrigs: {{other: {{twin: {fleet}/twin.yaml}}}}\n")
    other = tmp_path / "other"
    other.mkdir()
    (other / "store.json").write_text('{"schema": "pendulum_store/9"}')
    foreign = tmp_path / "foreign"
    foreign.mkdir()
    (foreign / "thesis.txt").write_text("mine")
    new = str(tmp_path / "new")
    (tmp_path / "empty").mkdir()
    cases = [
        (["run", f"{tmp_path}/empty", "--twins", table, "--store", new], "expected recordings"),
        (["run", data, "--twins", str(missing), "--store", new], "twin of rig rig_0: .*nowhere"),
        (["run", data, "--twins", str(none), "--store", new], "expected a rig for the 6 rec"),
        (["run", data, "--twins", table, "--store", str(other)], "found pendulum_store/9"),
        (["run", data, "--twins", table, "--store", str(foreign)], "found other files"),
        (["run", data, "--twins", table, "--store", new, "--scheduler", "tcp://127.0.0.1:9"],
         "expected a Dask scheduler"),
        (["run", data, "--twins", table, "--store", "no-such://place"], "fsspec knows"),
        (["history", str(tmp_path / "empty"), "--rig", "a"], "expected a store"),
        (["history", new, "--rig", "a"], "expected recordings, found an empty store"),
        (["page", str(other), "--out", new], "pendulum_store/9"),
        (["twin", new, "--rig", "a", "--out", f"{new}.yaml"], "empty store"),
    ]  # fmt: skip
    for words, sentence in cases:
        assert main(["fleet", *words]) == 1, words
        message = capsys.readouterr().err.strip().splitlines()[-1]
        assert message.startswith("sysid: "), message
        assert pd.Series([message]).str.contains(sentence).all(), (sentence, message)


def test_columns_are_read_by_the_table_and_time_themselves(tmp_path: Path) -> None:
    """A CSV file is a recording; its first time says when it was made."""
    from support.made_recordings import INTECO, made

    from pendulum_twin.model import save_twin

    s = made(INTECO, 8.0).signals
    frame = pd.DataFrame(
        {"t": 5000.0 + s.period_s * pd.RangeIndex(len(s)), "u": s.command, "x": s.cart,
         "a": s.pole}
    )  # fmt: skip
    (tmp_path / "data").mkdir()
    frame.to_csv(tmp_path / "data" / "run.csv", index=False)
    save_twin(INTECO, tmp_path / "twin.yaml")
    (tmp_path / "table.yaml").write_text(
        "schema: pendulum_fleet/1\nrigs:\n  cart: {twin: twin.yaml, recordings: 'data/*', "
        "columns: {time: t, command: u, cart: x, pole: a}}\n"
    )
    assert run(tmp_path, tmp_path / "store", *ALONE) == 0
    (row,) = Store(str(tmp_path / "store")).read_recordings().itertuples()
    assert (row.outcome, row.rig, row.time.timestamp()) == ("fitted", "cart", 5000.0)


def test_a_recording_that_is_named_in_several_ways_counts_once(
    fleet: Path, tmp_path: Path, capsys
) -> None:
    """A folder twice, the folder of a bag within it, a link, and another way of writing it."""
    data = tmp_path / "data"
    shutil.copytree(fleet / "data" / "rig_0", data / "rig_0")
    (data / "rig_0" / "linked").symlink_to(data / "rig_0" / "000")
    (tmp_path / "elsewhere").symlink_to(data / "rig_0" / "004")
    folders = [data, data, data / ".." / "data", data / "rig_0" / "000", tmp_path / "elsewhere"]
    words = ["fleet", "run", *map(str, folders), "--twins", str(fleet / "table.yaml")]
    words += ["--store", str(tmp_path / "store"), "--method", "fit", *ALONE]
    assert main(words) == 0
    assert "3 recordings: 0 known, 3 examined" in capsys.readouterr().out
    assert len(read(tmp_path / "store")) == 3


def test_a_recording_that_grows_while_it_is_examined_is_left_to_the_next_run(
    fleet: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    data = tmp_path / "data"
    shutil.copytree(fleet / "data" / "rig_0", data / "rig_0")
    short = next((data / "rig_0" / "000").glob("*.mcap"))
    whole_bytes = short.read_bytes()
    short.write_bytes(whole_bytes[: len(whole_bytes) * 9 // 10])
    words = ["fleet", "run", str(data), "--twins", str(fleet / "table.yaml"), "--store"]
    words += [str(tmp_path / "store"), "--method", "fit", *ALONE]
    monkeypatch.setattr(run_module, "examine_recording", examine_growing)
    assert main(words) == 0
    printed = capsys.readouterr()
    assert "000: growing: it is still being written" in printed.err
    assert "3 examined, 2 of them without an answer" in printed.out
    assert len(read(tmp_path / "store")) == 2
    monkeypatch.undo()
    short.write_bytes(whole_bytes)
    assert main(words) == 0
    assert "2 known, 1 examined, 0 of them" in capsys.readouterr().out
    assert sorted(read(tmp_path / "store")["outcome"]) == ["fitted", "fitted", "unusable"]


def test_linked_folders_are_searched_and_a_link_upwards_ends(tmp_path: Path) -> None:
    (tmp_path / "disk" / "rig_0" / "001").mkdir(parents=True)
    for name in ("metadata.yaml", "001.mcap"):
        (tmp_path / "disk" / "rig_0" / "001" / name).touch()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "linked").symlink_to(tmp_path / "disk")
    (tmp_path / "disk" / "upwards").symlink_to(tmp_path / "disk")
    names = [source.name for source in find_sources(str(tmp_path / "data"))]
    assert names == ["linked/rig_0/001"]


def test_a_closed_folder_is_left_out_and_a_closed_root_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "data" / "lost+found").mkdir(parents=True)
    (tmp_path / "data" / "run.csv").touch()
    scan = os.scandir

    def refuse(folder: str) -> object:
        """Refuse as for another user: root may read everything."""
        if folder.endswith(closed):
            raise PermissionError(13, "Permission denied")
        return scan(folder)

    monkeypatch.setattr(os, "scandir", refuse)
    closed = "lost+found"
    assert [source.name for source in find_sources(str(tmp_path / "data"))] == ["run.csv"]
    closed = "data"
    with pytest.raises(FileError, match="found Permission denied"):
        find_sources(str(tmp_path / "data"))


def test_an_interrupted_merge_shows_every_row_once(fleet: Path, whole, tmp_path: Path) -> None:
    shutil.copytree(fleet / "store", tmp_path / "store")
    for file in [*(tmp_path / "store").rglob("*.parquet")]:
        shutil.copy(file, file.with_name(f"again_{file.name}"))
    pd.testing.assert_frame_equal(read(tmp_path / "store"), whole)
    sizes = [Store(str(place)).read_sizes() for place in (tmp_path / "store", fleet / "store")]
    pd.testing.assert_frame_equal(*sizes)
