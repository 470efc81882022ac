"""The checks, and the finding of a check: what was expected, what was found, what to do."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

from pendulum_bridge.doctor.faults import Fault, Verdict


class Check(Enum):
    """The checks in their order; the value is group and name."""

    ADDRESS = ("ports", "rig's address")
    OUR_PORT = ("ports", "our port")
    RIG_PORT = ("ports", "rig listens")
    SAMPLES = ("samples", "arrive")
    PACKETS = ("samples", "packets")
    FIELDS = ("samples", "fields at rest")
    RATE = ("rate", "rate")
    JITTER = ("rate", "jitter")
    LOSSES = ("rate", "losses")
    REST = ("rest", "stands still")
    NOISE = ("rest", "noise")
    VELOCITIES = ("rest", "velocities")
    POLE_ZERO = ("zero", "pole")
    CART_ZERO = ("zero", "cart")
    MOVES = ("command", "cart moves")
    FIELDS_MOVING = ("command", "fields")
    VELOCITIES_MOVING = ("command", "velocities")
    DIRECTIONS = ("command", "directions")
    LATENCY = ("command", "latency")
    ACCELERATION = ("command", "acceleration")
    CLIPPING = ("limits", "command")
    RAIL = ("limits", "rail")
    RESET = ("reset", "reset flag")

    @property
    def group(self) -> str:
        """Return the group to which the check belongs."""
        return self.value[0]

    @property
    def title(self) -> str:
        """Return the check's name within its group."""
        return self.value[1]


@dataclass(frozen=True)
class Finding:
    """Hold the result of a check.

    expected, observed: for a person.
    fault: what is wrong; None when nothing is.
    skipped: whether the check was not made; `observed` then gives the reason.
    figures: what was measured, for programs; units are in the names.
    """

    check: Check
    expected: str
    observed: str
    fault: Fault | None = None
    skipped: bool = False
    figures: Mapping[str, float] = field(default_factory=dict)

    @property
    def verdict(self) -> Verdict:
        """Return how bad it is."""
        if self.skipped:
            return Verdict.SKIPPED
        return Verdict.OK if self.fault is None else self.fault.verdict

    @property
    def advice(self) -> str:
        """Return what to do about the fault; empty without a fault."""
        return "" if self.fault is None else self.fault.advice

    @property
    def line(self) -> str:
        """Return the finding in one line."""
        head = f"{self.verdict.name:<8} {f'{self.check.group}, {self.check.title}':<22} "
        if self.skipped:
            return head + self.observed
        return (
            head
            + f"expected {self.expected}; found {self.observed}"
            + (f". {self.advice}" if self.advice else "")
        )

    def to_mapping(self) -> dict[str, Any]:
        """Return the finding as JSON holds it."""
        mapping: dict[str, Any] = {
            "group": self.check.group,
            "check": self.check.title,
            "verdict": self.verdict.name,
            "fault": self.fault.name.lower() if self.fault else None,
            "expected": self.expected,
            "found": self.observed,
            "advice": self.advice,
        }
        return mapping | ({"figures": dict(self.figures)} if self.figures else {})


def skip_check(check: Check, reason: str) -> Finding:
    """Return the finding of a check that was not made."""
    return Finding(check, "", reason, skipped=True)
