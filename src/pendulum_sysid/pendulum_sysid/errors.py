"""Errors of system identification, a class a cause; all end a command in one sentence."""

from __future__ import annotations

from pendulum_sysid.records import Recording
from pendulum_twin.errors import BadInputError


class WrongUse(BadInputError):
    """Say that inputs do not fit together or that an option does not fit them."""

    exit_status = 2


class FileError(BadInputError):
    """Say that a file is missing, cannot be read or written, or does not hold its format."""


class UnusableRecording(BadInputError):
    """Say why a recording cannot answer the question.

    recording: as far as it was prepared; None when not even cleaning it worked.
    """

    def __init__(self, sentence: str, recording: Recording | None = None) -> None:
        super().__init__(sentence)
        self.recording = recording
