"""Make a whole bag of the bag that a killed recorder left; the damaged bag stays as it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from pendulum_bridge.recording.salvage import Salvage
from pendulum_twin.bags.bag import Bag
from pendulum_twin.bags.metadata import INDEX, read_index
from pendulum_twin.bags.records import Message, Tally, Topic
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest

BATCH = 5000  # messages between two flushes


@dataclass(frozen=True)
class Recovered:
    """Hold the result of a recovery.

    folder: of the whole bag; None when the bag was whole already.
    sentence: what was kept and what was lost.
    """

    folder: Path | None
    sentence: str


def recover(path: Path) -> Recovered:
    """Recover a bag's folder or its data file into `<folder>_recovered`.

    Raises BadInputError when there is no message to recover, or when that folder exists.
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
        and all(salvage.is_whole for salvage in salvages)
        and index.get("message_count") == tally.total
    ):
        return Recovered(None, f"{path} is whole: {_describe_kept(tally)}; nothing had to be done")
    target = (folder or path.with_suffix("")).with_name(f"{(folder or path).stem}_recovered")
    sentence = f"kept {_describe_kept(tally)}; {_describe_lost(salvages, index)}"
    custom = {
        **salvages[0].custom,
        **{str(key): str(text) for key, text in (index.get("custom_data") or {}).items()},
        "recovered": sentence,
        "recovered_from": ", ".join(f"{file.name} {compute_digest([file])}" for file in files),
    }
    custom.pop("digest", None)
    _write(files, Bag(target, started_ns=tally.first_ns or 0, custom=custom))
    return Recovered(
        target, f"{path}: {sentence}; the whole bag is {target}, the damaged bag stays as it was"
    )


def _find_data(path: Path) -> tuple[Path | None, list[Path]]:
    """Return the bag's folder (None for a lone file) and its data files, the earliest first."""
    if path.is_file() and path.name.startswith(f"{path.absolute().parent.name}_"):
        path = path.absolute().parent
    if path.is_dir():
        files = sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
        files = [file for file in files if file.stat().st_size]
        if files:
            return path.absolute(), files
        raise BadInputError(
            f"{path}: expected a folder with .mcap data in it, found none: "
            "name the recorder's folder"
        )
    if path.is_file() and path.suffix == ".mcap" and path.stat().st_size:
        return None, [path.absolute()]
    raise BadInputError(
        f"{path}: expected a rosbag2 folder or an .mcap file with data, found none: check the path"
    )


def _survey(files: Sequence[Path]) -> tuple[list[Salvage], Tally]:
    tally, salvages = Tally(), [Salvage(file) for file in files]
    for salvage in salvages:
        for record in salvage:
            if isinstance(record, Message):
                tally.add(record)
    return salvages, tally


def _write(files: Sequence[Path], bag: Bag) -> None:
    records = (record for file in files for record in Salvage(file))
    while batch := list(islice(records, BATCH)):
        for record in batch:
            if isinstance(record, Topic):
                bag.add_topic(record)
            else:
                bag.keep(record)
        bag.flush()
    bag.close("recovered")


def _describe_kept(tally: Tally) -> str:
    topics = ", ".join(f"{name} {count}" for name, count in sorted(tally.messages.items()))
    return f"{tally.total} messages over {tally.duration_ns / 1e9:.2f} s ({topics})"


def _describe_lost(salvages: Sequence[Salvage], index: dict) -> str:
    """Return what was lost, as a clause."""
    losses = list(_list_losses(salvages))
    if not index:
        losses.append(f"{INDEX} was missing or unreadable")
    return "; ".join(losses) or f"nothing was lost but a right {INDEX}"


def _list_losses(salvages: Sequence[Salvage]) -> Iterator[str]:
    for salvage in salvages:
        name, saved = salvage.path.name, salvage.saved_of_cut
        if salvage.lost_bytes:
            exception = f", of which {saved} messages were saved" if saved else ""
            yield f"lost {salvage.lost_bytes} bytes of {name} that were cut or damaged{exception}"
        elif salvage.nameless:
            yield f"lost {salvage.nameless} messages of {name} whose topic is unknown"
        elif not salvage.is_whole:
            yield f"{name} had no end mark"
