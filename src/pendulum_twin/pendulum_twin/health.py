"""Hold how a node is: a level, a sentence for a person, and the figures behind it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum


class Level(IntEnum):
    """How bad something is; the numbers are those of `diagnostic_msgs/DiagnosticStatus`."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True)
class Health:
    """Hold what a node says of itself once a second.

    level: how bad it is.
    sentence: for a person.
    figures: name -> number or text; units are in the names.
    """

    level: Level
    sentence: str
    figures: Mapping[str, float | int | str] = field(default_factory=dict)
