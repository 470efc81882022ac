"""Read `decisions.py` as a list: every number with its question, unit, reason and variants."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass

from pendulum_sysid import decisions

FACTOR = 1.5
LINE = re.compile(r"(?P<name>[A-Z][A-Z_0-9]*) = [^#]+  # (?P<unit>[^;]+); (?P<why>.+)")

Value = float | int | bool


@dataclass(frozen=True)
class Decision:
    """Hold one decision.

    name: of the attribute of `decisions`.
    question: that it helps to answer.
    value: as it stands.
    unit: of the value; "on or off" for a rule.
    why: this value.
    """

    name: str
    question: str
    value: Value
    unit: str
    why: str

    @property
    def variants(self) -> dict[str, Value]:
        """Return what to try in its place, by "up" and "down", or "off" for a rule.

        A ratio is varied in what it exceeds 1 by, a share stays at most 1, a count at least 1.
        """
        if isinstance(self.value, bool):
            return {"off": False}
        return {"up": self._scale(FACTOR), "down": self._scale(1.0 / FACTOR)}

    def _scale(self, factor: float) -> Value:
        if isinstance(self.value, int):
            moved = round(self.value * factor)
            other = self.value + (1 if factor > 1.0 else -1)
            return max(moved if moved != self.value else other, 1)
        if self.unit == "ratio":
            return 1.0 + (self.value - 1.0) * factor
        limit = 1.0 if self.unit.startswith(("of ", "prob")) else float("inf")
        return min(self.value * factor, limit)


def list_decisions() -> list[Decision]:
    """Return every decision in the order of the file.

    Raises ValueError for a line that does not say unit and reason.
    """
    question, decisions_read = "", []
    for line in inspect.getsource(decisions).splitlines():
        if line.startswith("# "):
            question = line[2:]
        elif re.match(r"[A-Z_0-9]+ = ", line):
            match = LINE.fullmatch(line)
            if match is None:
                raise ValueError(f"expected `NAME = value  # unit; why`, found: {line}")
            value = vars(decisions)[match["name"]]
            decisions_read.append(
                Decision(match["name"], question, value, match["unit"], match["why"])
            )
    return decisions_read
