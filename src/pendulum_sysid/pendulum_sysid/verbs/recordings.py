"""The recordings that a verb is given, read and cleaned."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_sysid.cleaning.clean import clean_recording
from pendulum_sysid.errors import UnusableRecording, WrongUse
from pendulum_sysid.reading.bag import COMMAND_TOPIC, STATE_TOPIC, read_bag
from pendulum_sysid.records import Recording
from pendulum_sysid.verbs.said import ANSWERED, say


def read_recordings(paths: list[Path], arguments: argparse.Namespace) -> list[Recording]:
    """Read and clean recordings; say which are not whole, or of an experiment given up.

    Raises WrongUse when a recording is named twice, FileError or UnusableRecording, with the path,
    when one cannot be used.
    """
    topics = arguments.state_topic or STATE_TOPIC, arguments.command_topic or COMMAND_TOPIC
    recordings: dict[str, Recording] = {}
    for path in paths:
        raw = read_bag(path, *topics)
        if raw.given_up:
            say(f"{path}: this recording is of an experiment that did not end: {raw.given_up}")
        if raw.digest in recordings:
            raise WrongUse(
                f"{path}: expected every recording once, found this one twice: name each once"
            )
        try:
            recording = clean_recording(raw)
        except UnusableRecording as error:
            raise UnusableRecording(f"{path}: {error}") from error
        if recording.losses:
            say(f"{path}: expected a whole recording, found {recording.losses}", ANSWERED)
        recordings[raw.digest] = recording
    return list(recordings.values())
