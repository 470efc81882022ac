"""What the view knows at a moment: frozen records, with times in s of a monotonic clock."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise
from statistics import median

SILENT_AFTER_S = 0.5  # a source that has said nothing for so long counts as silent


@dataclass(frozen=True)
class Sample:
    """Hold a sample; None for a joint that it does not name.

    stamp_ns: ns; sampling time on the source's clock.
    heard_s: s; arrival.
    age_s: s; age of the stamp on arrival, below 0 when the source's clock is ahead.
    cart_m: m; 0 in the middle of the rail.
    pole_rad: rad; 0 upright, counterclockwise positive, not wrapped.
    cart_m_s: m/s.
    pole_rad_s: rad/s.
    """

    stamp_ns: int
    heard_s: float
    age_s: float
    cart_m: float | None
    pole_rad: float | None
    cart_m_s: float | None
    pole_rad_s: float | None


@dataclass(frozen=True)
class Word:
    """Hold a command that was published.

    value: PWM fraction.
    heard_s: s; arrival.
    """

    value: float
    heard_s: float


@dataclass(frozen=True)
class Source:
    """Hold the messages of rig or twin.

    namespace: of the source.
    samples: the last samples, stamps rising.
    pwm: the last requested command.
    applied: the last applied command.
    stopped: whether the stop is latched; None while no node says so.
    refused: number of messages that held no sample.
    complaint: what was wrong with the last of these.
    """

    namespace: str
    samples: tuple[Sample, ...] = ()
    pwm: Word | None = None
    applied: Word | None = None
    stopped: bool | None = None
    refused: int = 0
    complaint: str = ""


@dataclass(frozen=True)
class NodeHealth:
    """Hold a node's health on `/diagnostics`.

    name: of the node.
    level: as in `DiagnosticStatus`: 0 ok, 1 warn, 2 error, 3 stale.
    sentence: for a person.
    heard_s: s; arrival.
    figures: further values by name.
    """

    name: str
    level: int
    sentence: str
    heard_s: float
    figures: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class PlanState:
    """Hold how the plan of an excitation node stands.

    offered: whether a node offers to play a plan now.
    outcome: the node's sentence about the plan; "" before the first.
    share: 0 to 1, of the plan that has been played.
    """

    offered: bool = False
    outcome: str = ""
    share: float = 0.0


class Stage(Enum):
    """How far a recording made from the page has come."""

    STARTING = "starting"
    RECORDING = "recording"
    CLOSING = "closing"
    WAITING = "waiting"  # for the diagnosis of an earlier recording
    DIAGNOSING = "diagnosing"
    DONE = "done"
    KEPT = "kept"  # without a diagnosis
    GIVEN_UP = "given_up"  # a person ended its diagnosis
    FAILED = "failed"

    @property
    def over(self) -> bool:
        """Whether no program works on the recording any more."""
        return self in (Stage.DONE, Stage.KEPT, Stage.GIVEN_UP, Stage.FAILED)

    @property
    def may_be_given_up(self) -> bool:
        """Whether a diagnosis is under way, or waits for its turn."""
        return self in (Stage.WAITING, Stage.DIAGNOSING)


@dataclass(frozen=True)
class RecordingState:
    """Hold how a recording made from the page stands.

    name: of its folder.
    began_s: s; when the recorder began to record, or was started.
    sentence: the last line of its diagnosis, then the verdict's sentence, or why it failed.
    share: 0 to 1, of its diagnosis.
    outcome: of the verdict; "" before.
    files: of its diagnosis, that the page serves.
    """

    name: str
    stage: Stage
    began_s: float
    sentence: str = ""
    share: float = 0.0
    outcome: str = ""
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class Snapshot:
    """Hold everything at now_s; rig or twin is None when the view does not listen to it.

    recordings: made from the page, the newest first; None where the page makes none.
    """

    now_s: float
    rig: Source | None
    twin: Source | None
    nodes: tuple[NodeHealth, ...] = ()
    plan: PlanState = PlanState()
    recordings: tuple[RecordingState, ...] | None = None


def compute_silence_s(source: Source, now_s: float) -> float | None:
    """Return how long a source has been silent, s; None when it was never heard."""
    return max(now_s - source.samples[-1].heard_s, 0.0) if source.samples else None


def is_fresh(source: Source | None, now_s: float) -> bool:
    """Tell whether a source is heard at present."""
    silent_s = compute_silence_s(source, now_s) if source else None
    return silent_s is not None and silent_s <= SILENT_AFTER_S


def compute_period_ns(samples: tuple[Sample, ...]) -> float | None:
    """Return the median time between samples by their stamps, ns.

    It is None for fewer than two samples.
    """
    return (
        median(b.stamp_ns - a.stamp_ns for a, b in pairwise(samples)) if len(samples) > 1 else None
    )
