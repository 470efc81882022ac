"""The protocol of the detectors: what is read off a recording instead of fitted.

A run jumps, or winds away, with some parameters, so that no small step of a fit leads to their
values; others show in no run at all. A detector reads them off the recording itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum

from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.records import Estimate
from pendulum_twin.arrays import Floats
from pendulum_twin.effects.effect import Effect


class Use(Enum):
    """What becomes of a reading."""

    START = "start"  # a fit starts from it
    NAME = "name"  # it is named beside what fits name: no run shows the effect
    CERTAIN = "certain"  # it is said to be certain where the rest has no name in the catalogue


@dataclass(frozen=True)
class Reading:
    """Hold what a detector read off a recording about one effect.

    effect: name of the effect.
    values: of the effect's parameters, in their order and units.
    estimates: parameter's name -> estimate with its 95 % interval; empty where a fit follows.
    lead: how far the effect is ahead of its absence; None where a fit follows.
    inseparable_from: names of the effects that would give the same reading.
    """

    effect: str
    values: tuple[float, ...]
    estimates: Mapping[str, Estimate] = field(default_factory=dict)
    lead: Lead | None = None
    inseparable_from: tuple[str, ...] = ()


@dataclass(frozen=True)
class Detector:
    """Read one effect off a recording.

    effect: what is looked for.
    use: what becomes of the readings.
    read: takes the case and theta (SIZE,) of the twin fitted so far; returns the readings, the
        clearest first, none where the effect does not show.
    """

    effect: Effect
    use: Use
    read: Callable[[Case, Floats], tuple[Reading, ...]]
