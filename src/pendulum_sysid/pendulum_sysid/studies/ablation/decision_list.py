"""Read `decisions.py` as a list: every number with its question, unit, reason and variants."""

from __future__ import annotations

import inspect
import re
from dataclasses import dataclass

from pendulum_sysid import decisions

FACTOR = 1.5
SHARES = ("of ", "prob", "quantile")  # units of values up to 1
LINE = re.compile(r"(?P<name>[A-Z][A-Z_0-9]*) = [^#]+  # (?P<unit>[^;]+); (?P<why>.+)")

Number = float | int | bool
Value = Number | tuple[float, ...]


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

        A ratio is varied in what it exceeds 1 by, a share stays at most 1, a count at least 1;
        several numbers are varied together.
        """
        if isinstance(self.value, bool):
            return {"off": False}
        return {"up": self._vary(FACTOR), "down": self._vary(1.0 / FACTOR)}

    @property
    def words(self) -> str:
        """Return the value for a reader."""
        if self.value is True:
            return "on"
        values = self.value if isinstance(self.value, tuple) else (self.value,)
        return ", ".join(f"{value:g}" for value in values)

    def _vary(self, factor: float) -> Value:
        if isinstance(self.value, tuple):
            return tuple(self._scale(value, factor) for value in self.value)
        return self._scale(self.value, factor)

    def _scale(self, value: Number, factor: float) -> Number:
        if isinstance(value, int):
            moved = round(value * factor)
            other = value + (1 if factor > 1.0 else -1)
            return max(moved if moved != value else other, 1)
        if self.unit == "ratio":
            return 1.0 + (value - 1.0) * factor
        limit = 1.0 if self.unit.startswith(SHARES) else float("inf")
        return min(value * factor, limit)


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
