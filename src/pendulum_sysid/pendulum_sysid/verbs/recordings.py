"""The recordings that a verb is given, read and cleaned."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_sysid.cleaning.clean import cleaned
from pendulum_sysid.cleaning.joining import one_recording
from pendulum_sysid.cleaning.stale_start import without_unanswered
from pendulum_sysid.reading.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
from pendulum_sysid.records import Recording
from pendulum_twin.errors import BadInputError


def recordings(paths: list[Path], arguments: argparse.Namespace) -> list[Recording]:
    """Return the recordings, read and cleaned; raise BadInputError when one cannot be used or stands there twice."""
    topics = arguments.state_topic or STATE_TOPIC, arguments.command_topic or COMMAND_TOPIC
    found: dict[str, Recording] = {}
    for path in paths:
        raw = read_bag(path, *topics)
        if raw.digest in found:
            raise BadInputError(
                f"{path}: expected every recording once, found this one twice: name each once"
            )
        try:
            found[raw.digest] = cleaned(raw)
        except BadInputError as error:
            raise BadInputError(f"{path}: {error}") from error
    return list(found.values())


def answered(path: Path, arguments: argparse.Namespace) -> Recording:
    """Return a recording without what goes before the cart's first answer, as a diagnosis judges it."""
    return without_unanswered(recordings([path], arguments)[0])


def answered_as_one(arguments: argparse.Namespace) -> Recording:
    """Return all recordings of `--bag` as one, each its own stretch and without what goes before its first answer."""
    return one_recording([without_unanswered(one) for one in recordings(arguments.bag, arguments)])
