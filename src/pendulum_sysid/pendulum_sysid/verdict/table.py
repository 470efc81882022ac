"""The verdict as a small HTML table, for a notebook."""

from __future__ import annotations

import math
from html import escape

from pendulum_sysid.verdict.record import MissingEffect, RigParameter, Verdict


def format_verdict(verdict: Verdict) -> str:
    """Return the answer, the missing effects and the refitted values as HTML."""
    outcome = escape(verdict.outcome.value.replace("_", " "))
    pieces = [f"<p><strong>{outcome}</strong>: {escape(verdict.sentence)}</p>"]
    if verdict.missing_physics:
        header = ("missing effect", "size with its 95 % interval", "confidence", "not told from")
        pieces.append(_format_table(header, [_list_effect(e) for e in verdict.missing_physics]))
    if verdict.list_given_values():
        header = ("value of the twin", "before", "after", "95 % interval")
        rows = [_list_value(name, p) for name, p in verdict.list_given_values().items()]
        pieces.append(_format_table(header, rows))
    return "\n".join(pieces)


def _list_effect(missing: MissingEffect) -> tuple[str, ...]:
    sizes = [
        f"{name}: {' '.join(_format_estimate(p.value, p.low, p.high))} {p.unit}"
        for name, p in missing.parameters.items()
    ]
    return (
        missing.effect,
        "; ".join(sizes) or "on or off",
        f"{missing.confidence:.1%}",
        ", ".join(missing.cannot_be_told_from) or "-",
    )


def _list_value(name: str, p: RigParameter) -> tuple[str, ...]:
    after, interval = _format_estimate(p.after, p.low, p.high)
    if not p.identifiable:
        interval = "not fixed by this recording"
    return name, f"{p.before:.4g} {p.unit}", f"{after} {p.unit}", interval


def _format_estimate(value: float, low: float, high: float) -> tuple[str, str]:
    """Return a value and its interval with the digits that the width of the interval is worth."""
    half = (high - low) / 2.0
    known = half > 0.0 and math.isfinite(half) and value != 0.0
    digits = math.ceil(math.log10(abs(value) / half)) + 2 if known else 4
    digits = min(max(digits, 3), 8)
    return f"{value:.{digits}g}", f"[{low:.{digits}g}, {high:.{digits}g}]"


def _format_table(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    lines = [_format_row("th", header), *(_format_row("td", row) for row in rows)]
    return "<table>\n" + "\n".join(lines) + "\n</table>"


def _format_row(tag: str, cells: tuple[str, ...]) -> str:
    return "<tr>" + "".join(f"<{tag}>{escape(cell)}</{tag}>" for cell in cells) + "</tr>"
