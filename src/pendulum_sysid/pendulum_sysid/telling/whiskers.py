"""The intervals of all parameters at a glance: values before and after on an axis each."""

from __future__ import annotations

import math
from dataclasses import dataclass

from pendulum_sysid.telling.display import add_unit, format_estimate, format_quantity
from pendulum_sysid.verdict.record import Verdict

MARGIN = 0.08  # of the axis, on either side


@dataclass(frozen=True)
class Whisker:
    """Hold one row: places on the row's own axis, 0 to 100, and the same as text.

    name: of the parameter.
    before, after: places of the values; None for an effect that the twin as given lacks.
    low, high: places of the ends of the 95 % interval; None where the recording fixes none.
    text: the values in words, which a screen reader gets.
    """

    name: str
    before: float | None
    after: float
    low: float | None
    high: float | None
    text: str


def list_whiskers(verdict: Verdict) -> tuple[Whisker, ...]:
    """Return the values of the given twin, then the parameters of the effects that were found."""
    rows = [
        _place(name, p.before, p.after, p.low, p.high, p.unit, p.identifiable)
        for name, p in verdict.list_given_values().items()
    ]
    rows += [
        _place(f"{missing.effect}.{name}", None, p.value, p.low, p.high, p.unit, True)
        for missing in (*verdict.missing_physics, *verdict.perhaps)
        for name, p in missing.parameters.items()
    ]
    return tuple(row for row in rows if row is not None)


def _place(
    name: str, before: float | None, after: float, low: float, high: float, unit: str, fixed: bool
) -> Whisker | None:
    """Return a row, its axis from the least to the largest of its values, or from 0 on."""
    known = fixed and math.isfinite(low) and math.isfinite(high)
    values = [after, 0.0 if before is None else before, *((low, high) if known else ())]
    if not all(math.isfinite(value) for value in values):
        return None
    least, most = min(values), max(values)
    span = (most - least) or max(abs(most), 1e-12)

    def put(value: float) -> float:
        return round(100.0 * (MARGIN + (1.0 - 2.0 * MARGIN) * (value - least) / span), 2)

    shown, interval = format_estimate(after, low, high)
    was = "absent" if before is None else format_quantity(before, unit, 4)
    return Whisker(
        name,
        None if before is None else put(before),
        put(after),
        put(low) if known else None,
        put(high) if known else None,
        f"before {was}, after {add_unit(shown, unit)}"
        + (f" {interval}" if known else ", not fixed by this recording"),
    )
