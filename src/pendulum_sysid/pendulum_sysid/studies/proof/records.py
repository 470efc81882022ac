"""The nouns of a proof: what was concealed, what was answered, and how both agree."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path


class NamesOutcome(Enum):
    """How the names of an answer compare with a seal; the value stands in `proof.json`."""

    RIGHT = "right"
    TIED = "tied"
    INCOMPLETE = "incomplete"
    MISSED = "missed"
    ABSTAINED = "abstained"
    WRONG = "wrong"
    FALSE_ALARM = "false_alarm"
    CRASHED = "crashed"

    @property
    def is_right(self) -> bool:
        """Whether the outcome counts as right."""
        return self in (NamesOutcome.RIGHT, NamesOutcome.TIED)

    @property
    def sentence(self) -> str:
        """The outcome for a person."""
        return SENTENCES[self]


SENTENCES = {
    NamesOutcome.RIGHT: "The diagnosis is right: it names what was concealed, and nothing else.",
    NamesOutcome.TIED: (
        "The diagnosis is right up to a tie: it names an effect which, by its own word, this "
        "recording cannot tell from the concealed one."
    ),
    NamesOutcome.INCOMPLETE: (
        "The diagnosis is incomplete: it names a part of what was concealed, and nothing wrong."
    ),
    NamesOutcome.MISSED: "The diagnosis missed what was concealed: it names nothing.",
    NamesOutcome.ABSTAINED: "The diagnosis abstained: it says that it cannot tell.",
    NamesOutcome.WRONG: "The diagnosis is wrong: it names physics that was not concealed.",
    NamesOutcome.FALSE_ALARM: (
        "The diagnosis gave a false alarm: it says that physics is missing, and nothing was "
        "concealed."
    ),
    NamesOutcome.CRASHED: "The diagnosis broke off with an error.",
}


@dataclass(frozen=True)
class UnlistedEffect:
    """Hold concealed physics that the catalogue does not have.

    name: its name in the seal.
    place: the place of the chain where it acts, as in a verdict's location.
    variables: the variables that it depends on, as in a verdict's evidence.
    """

    name: str
    place: str
    variables: tuple[str, ...]


@dataclass(frozen=True)
class Seal:
    """Hold what was concealed in an emulated rig.

    effects: catalogue name -> parameter -> true value; SI units, in the parameter's name.
    rig: key of the twin file -> true constant.
    unlisted: physics that the catalogue does not have.
    rest: small physics that the catalogue does not have, always on; nobody asks for its names.
    """

    effects: Mapping[str, Mapping[str, float]]
    rig: Mapping[str, float]
    unlisted: tuple[UnlistedEffect, ...] = ()
    rest: tuple[UnlistedEffect, ...] = ()


@dataclass(frozen=True)
class OpenedTrial:
    """Hold a trial with its seal open.

    name: the folder's name.
    bag: the folder of the recording.
    twin: the file of the nominal twin.
    kind: nothing, single, pair, triple, quadruple or unlisted.
    seed: what the trial was drawn from.
    pole_counts: counts a turn of the pole's encoder.
    seconds: the recording's length, s.
    closed_loop: whether a controller was recorded at work instead of a plan.
    relay: whether that controller knows three commands alone.
    size_factor: what every drawn size was multiplied by.
    seal: the truth.
    other: the folder of a second recording, of the same rig under another plan; None for none.
    pairs: whether the second recording is diagnosed, too.
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
    seal: Seal
    other: Path | None = None
    pairs: bool = False
    relay: bool = False


@dataclass(frozen=True)
class TrialAnswer:
    """Hold what a diagnosis, or a rival, says about a recording.

    outcome: as in verdict.json.
    named: effect -> the effects which, by the answer's own word, cannot be told from it.
    stale: whether stale samples were found.
    place: where the mismatch is; None for no place.
    variables: what the mismatch depends on; a product is written with a star.
    error: the error that broke the answer off; empty for none.
    random: whether most of what has no name is said to depend on nothing that was asked.
    """

    outcome: str
    named: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    stale: bool = False
    place: str | None = None
    variables: tuple[str, ...] = ()
    error: str = ""
    random: bool = False


@dataclass(frozen=True)
class Cell:
    """Hold one count of the confusion matrix.

    concealed: the concealed effect, or one of the stand-ins of `names`.
    named: the effect named in its place, or a stand-in.
    tied: whether the answer itself says that the two cannot be told apart.
    """

    concealed: str
    named: str
    tied: bool = False


@dataclass(frozen=True)
class NamesJudgement:
    """Hold how the names of an answer compare with the seal.

    outcome: the comparison as a whole.
    cells: which effect was taken for which.
    located: whether the place of unlisted physics is right; None where nothing is unlisted.
    depends: whether the evidence holds a variable of the unlisted physics; None likewise.
    """

    outcome: NamesOutcome
    cells: tuple[Cell, ...] = ()
    located: bool | None = None
    depends: bool | None = None


@dataclass(frozen=True)
class NameCounts:
    """Hold how many names of answers are false, and how many concealed effects have no name.

    names: in the answers.
    wrong: of these, names of what was not concealed.
    concealed: effects of the catalogue that were concealed, once for each answer.
    silent: of these, effects that the answers leave out.
    """

    names: int = 0
    wrong: int = 0
    concealed: int = 0
    silent: int = 0

    def __add__(self, other: NameCounts) -> NameCounts:
        """Return the counts of all answers of both."""
        return NameCounts(
            self.names + other.names,
            self.wrong + other.wrong,
            self.concealed + other.concealed,
            self.silent + other.silent,
        )


@dataclass(frozen=True)
class Size:
    """Hold a true size and its estimate with a 95 % interval.

    owner: an effect, or "rig" for a constant of the rig.
    parameter, unit: the parameter's name and its SI unit.
    shape: whether the parameter says where or how, not how much (a place, a period, a limit).
    true, value: truth and estimate, in the unit.
    low, high: the ends of the interval, in the unit.
    """

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
        """Whether the interval holds the truth."""
        return self.low <= self.true <= self.high

    @property
    def relative_error(self) -> float | None:
        """The estimate's distance from the truth relative to it, unsigned; None for truth 0."""
        return abs(self.value / self.true - 1.0) if self.true else None

    @property
    def half_width(self) -> float:
        """The larger half of the interval, in the unit."""
        return max(self.high - self.value, self.value - self.low)


@dataclass(frozen=True)
class HeldOut:
    """Hold scores on held-out windows; 1 is the sensors' noise, None a score that is missing.

    before: of the nominal twin.
    after: of the improved twin.
    oracle: of the oracle fit (see `oracle_fit`).
    floor: what a perfect model would reach.
    """

    before: float | None
    after: float | None
    oracle: float | None
    floor: float | None

    @property
    def ratio(self) -> float | None:
        """The improved twin's score divided by the oracle fit's; None where either is missing."""
        if self.after is None or not self.oracle:
            return None
        return self.after / self.oracle


@dataclass(frozen=True)
class RivalJudgement:
    """Hold the effects that a rival named, how they compare with the seal, and its seconds."""

    named: tuple[str, ...]
    names: NamesJudgement
    seconds: float


@dataclass(frozen=True)
class ModelJudgement:
    """Hold how well a rival's model predicts another recording of the rig.

    floors: its score there, over the score of a perfect model; None where there is none.
    cpu_seconds: of fit and runs, s.
    error: what broke it off; empty for none.
    """

    floors: float | None
    cpu_seconds: float
    error: str = ""


@dataclass(frozen=True)
class PairJudgement:
    """Hold how the answers to two recordings of a rig agree.

    answer: to the second recording.
    agree: whether both name the same effects, up to what they cannot tell apart themselves.
    common: sizes that both give, the estimates of the first and of the second recording.
    sizes: parameters of the effects that the second diagnosis named rightly.
    given, improved: scores on the second recording over its floor, of the nominal twin and of the
        twin improved by the first recording; None where there is none.
    """

    answer: TrialAnswer
    agree: bool
    common: tuple[tuple[Size, Size], ...]
    sizes: tuple[Size, ...]
    given: float | None
    improved: float | None

    @property
    def overlapping(self) -> int:
        """The number of sizes whose two intervals overlap."""
        return sum(a.low <= b.high and b.low <= a.high for a, b in self.common)

    @property
    def is_better(self) -> bool:
        """Whether the improved twin runs better on the second recording than the nominal twin.

        A diagnosis that improves nothing makes nothing worse.
        """
        return self.improved is None or self.given is None or self.improved <= self.given


@dataclass(frozen=True)
class Judgement:
    """Hold one trial compared with its seal.

    sizes: parameters of the effects that the diagnosis named rightly.
    rig: constants of the rig that the diagnosis calls identifiable.
    oracle: parameters of the concealed effects, by the oracle fit.
    seconds: wall time of the diagnosis, from opening the bag to the verdict, s.
    cpu_seconds: CPU time of its one thread, s.
    rivals: by name, those that name effects.
    models: by name, the rivals that predict.
    modelled: score of the improved twin on another recording of the rig, over the score that a
        perfect model reaches there; None where there is no such recording.
    pair: how the answer agrees with the answer to a second recording; None where there is none.
    """

    trial: OpenedTrial
    answer: TrialAnswer
    names: NamesJudgement
    sizes: tuple[Size, ...]
    rig: tuple[Size, ...]
    oracle: tuple[Size, ...]
    held_out: HeldOut
    seconds: float
    cpu_seconds: float
    rivals: Mapping[str, RivalJudgement] = field(default_factory=dict)
    models: Mapping[str, ModelJudgement] = field(default_factory=dict)
    modelled: float | None = None
    pair: PairJudgement | None = None
