"""The nouns of a proof: what was concealed, what was answered, and how both agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

KINDS = ("nothing", "single", "pair", "triple", "unlisted")


class NamesOutcome(Enum):
    """How an answer about names came out."""

    RIGHT = "right"
    TIED = "tied"  # right, where what cannot be told apart counts as the same
    INCOMPLETE = "incomplete"  # no wrong name, but not all names
    MISSED = "missed"  # nothing named, although something is there
    ABSTAINED = "abstained"  # said that it cannot tell
    WRONG = "wrong"  # a name of what is not there
    FALSE_ALARM = "false_alarm"  # something is missing, it says, where nothing is
    CRASHED = "crashed"

    @property
    def right(self) -> bool:
        """Return whether it counts as right."""
        return self in (NamesOutcome.RIGHT, NamesOutcome.TIED)


@dataclass(frozen=True)
class UnlistedEffect:
    """Hold physics that the catalogue does not have: its name, its place, and the variables that it depends on."""

    name: str
    place: str
    variables: tuple[str, ...]


@dataclass(frozen=True)
class OpenedTrial:
    """Hold a trial with its seal open.

    effects: catalogue name -> parameter -> true value. rig: the true constants by the twin file's
    keys. bag, twin: where the recording and the nominal twin are.
    """

    name: str
    bag: Path
    twin: Path
    kind: str
    seed: int
    pole_counts: int
    seconds: float
    closed_loop: bool
    size_factor: float
    effects: Mapping[str, Mapping[str, float]]
    rig: Mapping[str, float]
    unlisted: tuple[UnlistedEffect, ...] = ()


@dataclass(frozen=True)
class Answer:
    """Hold what a diagnosis, or a rival, says about a recording.

    outcome: as in the verdict. named: effect -> those it cannot be told from. stale: stale samples
    were found. place,
    variables: where and on what the mismatch depends. error: of an answer that broke off.
    """

    outcome: str
    named: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    stale: bool = False
    place: str | None = None
    variables: tuple[str, ...] = ()
    error: str = ""


@dataclass(frozen=True)
class Cell:
    """Hold one entry of the confusion matrix: what was concealed, what was named for it, and whether a tie excuses it."""

    concealed: str
    named: str
    tied: bool = False


@dataclass(frozen=True)
class NamesJudgement:
    """Hold how the names came out; located and depends: of unlisted physics, whether place and variable are right."""

    how: NamesOutcome
    cells: tuple[Cell, ...] = ()
    located: bool | None = None
    depends: bool | None = None


@dataclass(frozen=True)
class Size:
    """Hold a true size and its estimate with a 95 % interval; owner: an effect, or "rig" for one of its constants."""

    owner: str
    parameter: str
    unit: str
    shape: bool
    true: float
    value: float
    low: float
    high: float

    @property
    def inside(self) -> bool:
        """Return whether the interval holds the truth."""
        return self.low <= self.true <= self.high

    @property
    def error(self) -> float | None:
        """Return the relative error, None where the truth is 0."""
        return abs(self.value / self.true - 1.0) if self.true else None

    @property
    def half_width(self) -> float:
        """Return the larger half of the interval."""
        return max(self.high - self.value, self.value - self.low)


@dataclass(frozen=True)
class HeldOut:
    """Hold scores on held-out windows: of the nominal twin, of the improved one, of a fit told the truth; the floor."""

    before: float | None
    after: float | None
    told: float | None
    floor: float | None

    @property
    def ratio(self) -> float | None:
        """Return how many times as far off the improved twin is as the fit that was told the truth."""
        return self.after / self.told if self.after is not None and self.told else None


@dataclass(frozen=True)
class RivalJudged:
    """Hold what a rival named, how that came out, and the seconds it took."""

    named: tuple[str, ...]
    names: NamesJudgement
    seconds: float


@dataclass(frozen=True)
class Judgement:
    """Hold one trial judged. sizes, rig: of the diagnosis; told: of the fit that was told the truth.

    seconds, cpu_seconds: of the diagnosis, by the clock and of its one thread.
    """

    sealed: OpenedTrial
    answer: Answer
    names: NamesJudgement
    sizes: tuple[Size, ...]
    rig: tuple[Size, ...]
    told: tuple[Size, ...]
    held_out: HeldOut
    seconds: float
    cpu_seconds: float
    rivals: Mapping[str, RivalJudged] = field(default_factory=dict)
