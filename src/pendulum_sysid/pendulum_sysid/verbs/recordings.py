"""The recordings that a verb is given, read and cleaned."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.reading.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
from pendulum_sysid.records import Recording
from pendulum_twin.errors import BadInputError


def read_recordings(paths: list[Path], arguments: argparse.Namespace) -> list[Recording]:
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
            found[raw.digest] = clean_recording(raw)
        except BadInputError as error:
            raise BadInputError(f"{path}: {error}") from error
    return list(found.values())
