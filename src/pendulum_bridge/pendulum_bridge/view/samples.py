"""What the view knows at one moment: frozen records, times in s on a monotonic clock unless a name says otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import pairwise
from statistics import median

SILENT_AFTER_S = 0.5  # a source that has said nothing for so long counts as silent


@dataclass(frozen=True)
class Sample:
    """Hold one sample; None for a joint that it does not name.

    stamp_ns: sampling time on the source's clock. heard_s: when it arrived. age_s: how old its
    stamp was on arrival (below 0: the source's clock is ahead of ours). Angle 0 upright,
    counterclockwise positive, not wrapped.
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
    """Hold one number that was said, and when it was heard: a command, as a PWM fraction."""

    value: float
    heard_s: float


@dataclass(frozen=True)
class Source:
    """Hold what rig or twin said. samples: the last ones, stamps rising. stopped: None while nobody says.

    refused: how many messages were no samples; complaint: what was wrong with the last of them.
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
    """Hold what a node said of itself on `/diagnostics`; level as in `DiagnosticStatus`: 0 ok, 1 warn, 2 error, 3 stale."""

    name: str
    level: int
    sentence: str
    heard_s: float
    figures: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Snapshot:
    """Hold everything at now_s; rig or twin is None when the view was told not to listen to it."""

    now_s: float
    rig: Source | None
    twin: Source | None
    nodes: tuple[NodeHealth, ...] = ()


def compute_silence_s(source: Source, now_s: float) -> float | None:
    """Return for how long a source has said nothing, s; None when it never said anything."""
    return max(now_s - source.samples[-1].heard_s, 0.0) if source.samples else None


def is_fresh(source: Source | None, now_s: float) -> bool:
    """Tell whether a source is heard at present."""
    silent_s = compute_silence_s(source, now_s) if source else None
    return silent_s is not None and silent_s <= SILENT_AFTER_S


def compute_period_ns(samples: tuple[Sample, ...]) -> float | None:
    """Return the usual time between samples by their stamps, ns; None for fewer than two."""
    return (
        median(b.stamp_ns - a.stamp_ns for a, b in pairwise(samples)) if len(samples) > 1 else None
    )
