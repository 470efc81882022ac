"""Make a whole bag of what a killed recorder left, beside the damaged one, which stays as it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from pendulum_bridge.recording.bag import Bag, compute_digest
from pendulum_bridge.recording.metadata import INDEX, read_index
from pendulum_bridge.recording.records import Message, Tally, Topic
from pendulum_bridge.recording.salvage import Salvage
from pendulum_twin.errors import BadInputError

BATCH = 5000  # messages written at a time


@dataclass(frozen=True)
class Recovered:
    """Hold where the whole bag is (None when nothing had to be done), and in a sentence what was kept and lost."""

    folder: Path | None
    sentence: str


def recover(path: Path) -> Recovered:
    """Recover a bag's folder or its data file into `<folder>_recovered`.

    Raises BadInputError when there is nothing to recover from, or the place is taken.
    """
    folder, files = _find_data(path)
    salvages, tally = _survey(files)
    if not tally.total:
        raise BadInputError(
            f"{path}: expected messages, found none in {len(files)} data file(s): record again"
        )
    index = read_index(folder) if folder else {}
    if (
        folder
        and all(each.whole for each in salvages)
        and index.get("message_count") == tally.total
    ):
        return Recovered(None, f"{path} is whole: {_describe_kept(tally)}; nothing had to be done")
    target = (folder or path.with_suffix("")).with_name(f"{(folder or path).stem}_recovered")
    sentence = f"kept {_describe_kept(tally)}; {_describe_lost(salvages, index)}"
    custom = {
        **salvages[0].custom,
        **{str(key): str(text) for key, text in (index.get("custom_data") or {}).items()},
        "recovered": sentence,
        "recovered_from": ", ".join(f"{file.name} {compute_digest(file)}" for file in files),
    }
    custom.pop("digest", None)
    _write(files, Bag(target, started_ns=tally.first_ns or 0, custom=custom))
    return Recovered(
        target, f"{path}: {sentence}; the whole bag is {target}, the damaged one stays as it was"
    )


def _find_data(path: Path) -> tuple[Path | None, list[Path]]:
    """Return the bag's folder, if there is one, and its data files in the order of recording."""
    if path.is_file() and path.name.startswith(f"{path.absolute().parent.name}_"):
        path = path.absolute().parent
    if path.is_dir():
        files = sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
        files = [file for file in files if file.stat().st_size]
        if files:
            return path.absolute(), files
        raise BadInputError(
            f"{path}: expected a folder with .mcap data in it, found none: name the recorder's folder"
        )
    if path.is_file() and path.suffix == ".mcap" and path.stat().st_size:
        return None, [path.absolute()]
    raise BadInputError(
        f"{path}: expected a rosbag2 folder or an .mcap file with data, found none: check the path"
    )


def _survey(files: Sequence[Path]) -> tuple[list[Salvage], Tally]:
    tally, salvages = Tally(), [Salvage(file) for file in files]
    for salvage in salvages:
        for found in salvage:
            if isinstance(found, Message):
                tally.add(found)
    return salvages, tally


def _write(files: Sequence[Path], bag: Bag) -> None:
    contents = (found for file in files for found in Salvage(file))
    while batch := list(islice(contents, BATCH)):
        for found in batch:
            if isinstance(found, Topic):
                bag.add_topic(found)
            else:
                bag.keep(found)
        bag.flush()
    bag.close("recovered")


def _describe_kept(tally: Tally) -> str:
    topics = ", ".join(f"{name} {count}" for name, count in sorted(tally.messages.items()))
    return f"{tally.total} messages over {tally.duration_ns / 1e9:.2f} s ({topics})"


def _describe_lost(salvages: Sequence[Salvage], index: dict) -> str:
    """Say what is missing; an index that was left behind by a kill counts too few, one of a whole bag all."""
    parts = list(_list_losses(salvages))
    if not index:
        parts.append(f"{INDEX} was missing or unreadable")
    return "; ".join(parts) or f"nothing was lost but a right {INDEX}"


def _list_losses(salvages: Sequence[Salvage]) -> Iterator[str]:
    for each in salvages:
        if each.lost_bytes:
            saved = (
                f", of which {each.saved_of_cut} messages were saved" if each.saved_of_cut else ""
            )
            yield f"lost {each.lost_bytes} bytes of {each.path.name} that were cut or damaged{saved}"
        elif each.nameless:
            yield f"lost {each.nameless} messages of {each.path.name} whose topic is unknown"
        elif not each.whole:
            yield f"{each.path.name} had no end mark"
