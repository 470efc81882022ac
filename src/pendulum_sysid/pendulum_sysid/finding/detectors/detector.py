"""The protocol of the detectors: what is read off a recording instead of fitted.

A run jumps, or winds away, with some parameters, so that no small step of a fit leads to their
values; others show in no run at all. A detector reads them off the recording itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property

from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.localisation.balance import (
    FORCE,
    Balance,
    Motion,
    compute_motion,
    make_balance,
)
from pendulum_sysid.finding.localisation.thinning import thin_out
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
class Sight:
    """Hold a recording as a twin sees it; what several detectors ask for is computed once.

    case: the recording.
    theta: (SIZE,) of the twin fitted so far.
    """

    case: Case
    theta: Floats

    @cached_property
    def thinned(self) -> Case:
        """Return the case, thinned out where it is long."""
        return thin_out(self.case)

    @cached_property
    def motion(self) -> Motion:
        """Return the motion of the thinned recording, seen through the twin's sensors."""
        return compute_motion(self.thinned, self.theta)

    @cached_property
    def force(self) -> Balance | None:
        """Return the balance of the cart's force in the thinned recording; None without a cart."""
        return make_balance(self.thinned, self.theta, FORCE)


@dataclass(frozen=True)
class Detector:
    """Read one effect off a recording.

    effect: what is looked for.
    use: what becomes of the readings.
    read: returns the readings, the clearest first, none where the effect does not show.
    """

    effect: Effect
    use: Use
    read: Callable[[Sight], tuple[Reading, ...]]
