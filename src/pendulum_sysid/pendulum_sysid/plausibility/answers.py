"""What a question to a recording and its twin comes to."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class CheckAnswer(Enum):
    """What a check comes to."""

    YES = "yes"
    DOUBT = "doubt"  # worth a look; the diagnosis goes on
    NO = "no"  # the recording cannot be one of this rig as it stands


@dataclass(frozen=True)
class Check:
    """Hold one question to a recording and its twin.

    question: in words.
    answer: yes, doubt or no.
    expected, observed: in words, with units.
    advice: what to do; empty for yes.
    """

    question: str
    answer: CheckAnswer
    expected: str
    observed: str
    advice: str = ""

    @property
    def sentence(self) -> str:
        """Return the check as one sentence."""
        said = f"expected {self.expected}, found {self.observed}"
        return f"{said}: {self.advice}" if self.advice else said
