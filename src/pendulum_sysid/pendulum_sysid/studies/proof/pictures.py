"""The proof's pictures as inline SVG, small enough to be written by hand: dots on a line, dots in a square."""

from __future__ import annotations

import math
from collections.abc import Sequence
from html import escape

from pendulum_sysid.telling.figures import ACCENT, INK, PALE, SOFT

STRIP_W, STRIP_H, EDGE = 260, 22, 6
SIDE, MARGIN = 300, 46


def draw_strip(values: Sequence[float], half_range: float, label: str) -> str:
    """Return signed values as dots about a middle line, those beyond the range at its edge as rings; "" for none."""
    if not values:
        return ""
    middle, room = STRIP_W / 2, STRIP_W / 2 - EDGE
    parts = [
        f'<path d="M{EDGE} {STRIP_H / 2}H{STRIP_W - EDGE}" stroke="{PALE}"/>',
        f'<path d="M{middle:g} 2V{STRIP_H - 2}" stroke="{SOFT}"/>',
    ]
    for value in values:
        out = not abs(value) <= half_range
        far = math.copysign(1.0, value) if out else value / half_range
        look = (
            f'fill="#fff" stroke="{INK}" stroke-width="1.2"'
            if out
            else f'fill="{ACCENT}" fill-opacity="0.55"'
        )
        parts.append(
            f'<circle cx="{middle + room * far:.1f}" cy="{STRIP_H / 2:g}" r="3.4" {look}/>'
        )
    return _svg(STRIP_W, STRIP_H, label, parts)


def draw_scatter(
    points: Sequence[tuple[float, float]], x_label: str, y_label: str, factor: float, label: str
) -> str:
    """Return points (x, y) above 0 on logarithmic scales, with the diagonal and, dashed, that times factor; "" for none."""
    points = [
        (x, y) for x, y in points if x > 0 and y > 0 and math.isfinite(x) and math.isfinite(y)
    ]
    if not points:
        return ""
    values = [v for pair in points for v in pair]
    low, high = math.log10(min(values) / 1.2), math.log10(max(values) * 1.2)
    span = high - low

    def at(value: float) -> float:
        return (math.log10(value) - low) / span * (SIDE - MARGIN - EDGE)

    def place(x: float, y: float) -> str:
        return f"{MARGIN + at(x):.1f} {SIDE - MARGIN - at(y):.1f}"

    bottom, top = 10**low, 10**high
    parts = [
        f'<path d="M{MARGIN} {EDGE}V{SIDE - MARGIN}H{SIDE - EDGE}" fill="none" stroke="{SOFT}" stroke-width="0.7"/>',
        f'<path d="M{place(bottom, bottom)}L{place(top, top)}" stroke="{SOFT}" stroke-width="0.8"/>',
        f'<path d="M{place(bottom, bottom * factor)}L{place(top / factor, top)}" stroke="{INK}" stroke-dasharray="4 3"/>',
    ]
    for tick in _ticks(low, high):
        spot = at(tick)
        parts.append(_text(MARGIN + spot, SIDE - MARGIN + 14, f"{tick:g}", "middle"))
        parts.append(_text(MARGIN - 5, SIDE - MARGIN - spot + 3.5, f"{tick:g}", "end"))
    for x, y in points:
        x_at, y_at = place(x, y).split()
        parts.append(
            f'<circle cx="{x_at}" cy="{y_at}" r="3.4" fill="{ACCENT}" fill-opacity="0.55"/>'
        )
    parts.append(_text((MARGIN + SIDE) / 2, SIDE - 8, x_label, "middle"))
    parts.append(
        f'<g transform="translate(11 {(SIDE - MARGIN) / 2:g}) rotate(-90)">{_text(0, 0, y_label, "middle")}</g>'
    )
    return _svg(SIDE, SIDE, label, parts)


def _ticks(low: float, high: float) -> list[float]:
    """Return 1, 2, 5 and their powers of ten inside, only powers of ten when there are many."""
    steps = (1, 1.5, 2, 3, 5, 7) if high - low < 0.7 else (1, 2, 5) if high - low < 1.5 else (1,)
    decades = range(math.floor(low), math.ceil(high) + 1)
    return [s * 10.0**d for d in decades for s in steps if low <= math.log10(s * 10.0**d) <= high]


def _text(x: float, y: float, words: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="10.5" fill="{INK}" text-anchor="{anchor}">{escape(words)}</text>'


def _svg(width: int, height: int, label: str, parts: Sequence[str]) -> str:
    head = f'<svg role="img" aria-label="{escape(label)}" viewBox="0 0 {width} {height}" width="{width}" height="{height}">'
    return head + "".join(parts) + "</svg>"
