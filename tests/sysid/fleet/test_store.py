"""The store when several runs use it, and when the work goes back to an earlier twin or method."""

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from support.fleet_rows import SIZES, make_result

from pendulum_sysid.errors import FileError
from pendulum_sysid.fleet.places import Place
from pendulum_sysid.fleet.recordings import Source, fetch, find_sources, read_beginning
from pendulum_sysid.fleet.rows import Result
from pendulum_sysid.fleet.store import FILES_MERGED, RECORDINGS, Store


@pytest.fixture
def store(tmp_path: Path) -> Store:
    """A store with as many files of a rig as a run merges."""
    store = Store(str(tmp_path / "store"))
    store.create()
    for day in range(FILES_MERGED):
        store.write([make_result("r", day, SIZES)])
    return store


def list_methods(store: Store) -> set[str]:
    return {method for *_, method in store.list_done()}


def test_an_earlier_method_is_not_known_once_another_replaced_it(tmp_path: Path) -> None:
    """History, comparison and site read the latest rows: only these are known."""
    store = Store(str(tmp_path / "store"))
    store.create()
    diagnosed = make_result("r", 0, SIZES, method="diagnose", outcome="named")
    store.write([diagnosed])
    assert list_methods(store) == {"diagnose"}
    later = diagnosed.recording.written_at.replace(year=2027)
    fitted = replace(diagnosed.recording, method="fit", outcome="fitted", written_at=later)
    store.write([Result(fitted, diagnosed.sizes)])
    assert set(store.read_recordings()["method"]) == list_methods(store) == {"fit"}


def test_a_reader_sees_every_row_while_another_run_merges(
    store: Store, monkeypatch: pytest.MonkeyPatch
) -> None:
    read, merged = Place.read, []

    def merge_first(place: Place, name: str) -> bytes | None:
        if name.startswith(RECORDINGS) and not merged:
            merged.append(name)
            Store(store.address).merge()
        return read(place, name)

    monkeypatch.setattr(Place, "read", merge_first)
    assert len(store.read_recordings()) == FILES_MERGED
    assert len(store.read_sizes()) == FILES_MERGED * len(SIZES)


@pytest.mark.parametrize("moment", ["read", "remove"])
def test_two_runs_may_merge_at_once(
    store: Store, monkeypatch: pytest.MonkeyPatch, moment: str
) -> None:
    act, merged = getattr(Place, moment), []

    def merge_first(place: Place, name: str) -> bytes | None:
        if not merged:
            merged.append(name)
            Store(store.address).merge()
        return act(place, name)

    monkeypatch.setattr(Place, moment, merge_first)
    store.merge()
    assert len(store.read_recordings()) == FILES_MERGED
    assert len(store.read_sizes()) == FILES_MERGED * len(SIZES)


def test_a_copy_from_elsewhere_has_the_time_of_its_original() -> None:
    """Without times of its own a recording began when its file was written, not when copied."""
    place = Place("memory://bucket/bench")
    place.write("r/run.mcap", b"no recording")
    written = datetime(2026, 1, 5, tzinfo=UTC)
    place.fs.store[place.locate("r/run.mcap")].modified = written
    with fetch(Source("memory://bucket/bench", "r/run.mcap", ("r/run.mcap",))) as path:
        assert read_beginning(path, None) == written


def write_bag_elsewhere(address: str, name: str) -> Place:
    place = Place(address)
    place.write(f"{name}metadata.yaml", b"the index")
    place.write(f"{name}run_0.mcap", b"no recording")
    return place


@pytest.mark.parametrize("name", ["", "day_1/"])
def test_a_bag_elsewhere_is_copied_whole(name: str) -> None:
    """Also where the address that was given is the bag itself."""
    address = f"memory://bucket/whole/{len(name)}"
    write_bag_elsewhere(address, name)
    (source,) = find_sources(address)
    with fetch(source) as path:
        copied = {file.name: file.read_bytes() for file in path.iterdir()}
    assert copied == {"metadata.yaml": b"the index", "run_0.mcap": b"no recording"}


@pytest.mark.parametrize("gone", ["metadata.yaml", "run_0.mcap"])
def test_a_file_that_went_before_it_was_copied_is_told(gone: str) -> None:
    address = f"memory://bucket/gone/{gone}"
    place = write_bag_elsewhere(address, "day_1/")
    (source,) = find_sources(address)
    place.remove(f"day_1/{gone}")
    sentence = f"{source.path}: expected day_1/{gone}, found it gone: "
    with pytest.raises(FileError, match=sentence), fetch(source):
        pass


def test_a_table_that_went_before_it_was_copied_is_told() -> None:
    place = Place("memory://bucket/table")
    place.write("run.csv", b"t,u")
    (source,) = find_sources("memory://bucket/table")
    place.remove("run.csv")
    with pytest.raises(FileError, match=r"expected run\.csv, found it gone"), fetch(source):
        pass
