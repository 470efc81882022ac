"""Format numbers, intervals and units for people: few digits, a real minus sign, a dash."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from numbers import Real
from typing import Any

NOTHING = "\u2013"
NARROW_SPACE = "\u202f"
NO_BREAK_SPACE = "\u00a0"
SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
PLAIN_EXPONENTS = range(-3, 6)  # powers of ten that are written out
MOST_DIGITS = 6
MOST_INTERVALS = 8
SHORTEST_SPAN_S = 0.1
SIGNS = {"+-": "±", " -> ": " → "}  # of a plain sentence -> of a page
POWER = re.compile(r"(?<![\w./])(?<!\w-)(\d+(?:\.\d+)?)e([+-]\d+)\b")  # 4.5e-05, no name
NEGATIVE = re.compile(r"(?<![\w./−-])-(?=\d)")  # no hyphen, date or path


def render_number(value: Any, digits: int = 3) -> str:
    """Return a number with `digits` significant digits; a dash for what is no number."""
    real = _convert_real(value)
    if real is None:
        return NOTHING
    exponent = _compute_exponent(real)
    scale = 0 if exponent in PLAIN_EXPONENTS else exponent
    return _format_fixed(real, digits - 1 - exponent + scale, scale) + _format_power(scale)


def format_estimate(value: Any, low: Any, high: Any) -> tuple[str, str]:
    """Return a value and its interval "[low, high]" with the digits that the interval is worth."""
    middle, bottom, top = _convert_real(value), _convert_real(low), _convert_real(high)
    if (
        middle is None
        or bottom is None
        or top is None
        or not all(map(math.isfinite, (middle, bottom, top)))
    ):
        has_bound = any(bound is not None and math.isfinite(bound) for bound in (bottom, top))
        return render_number(
            value, 4
        ), f"[{render_number(low)}, {render_number(high)}]" if has_bound else NOTHING
    exponent = max(_compute_exponent(v) for v in (middle, bottom, top))
    scale = 0 if exponent in PLAIN_EXPONENTS else exponent
    decimals = _count_decimals(max(middle - bottom, top - middle), exponent) + scale
    texts = [_format_fixed(v, decimals, scale) for v in (middle, bottom, top)]
    return texts[0] + _format_power(scale), f"[{texts[1]}, {texts[2]}]{_format_power(scale)}"


def format_quantity(value: Any, unit_name: Any, digits: int = 3) -> str:
    """Return a number with its unit."""
    return add_unit(render_number(value, digits), unit_name)


def add_unit(text: str, unit_name: Any) -> str:
    """Return a number's text with its unit on one line; a dash or a bare number stays as it is."""
    symbol = format_unit(unit_name)
    return f"{text}{NO_BREAK_SPACE}{symbol}" if symbol and text != NOTHING else text


def format_unit(name: Any) -> str:
    """Return a unit such as "kg m^2" as "kg·m²", and nothing for "1" or None."""
    if not isinstance(name, str) or name in ("", "1"):
        return ""
    raised = re.sub(r"\^(-?\d+)", lambda match: match[1].translate(SUPERSCRIPTS), name)
    return raised.strip().replace(" ", "·")


def format_count(value: Any) -> str:
    """Return a whole number, in groups of three digits from 10 000 on."""
    real = _convert_real(value)
    return NOTHING if real is None or not math.isfinite(real) else _format_fixed(real, 0, 0)


def format_percent(share: Any) -> str:
    """Return a fraction in per cent."""
    real = _convert_real(share)
    return (
        NOTHING
        if real is None or not math.isfinite(real)
        else f"{100 * real:.0f}{NO_BREAK_SPACE}%"
    )


def format_confidence(value: Any) -> str:
    """Return a probability in per cent, with no claim to certainty."""
    real = _convert_real(value)
    if real is None or not math.isfinite(real):
        return NOTHING
    if real > 0.9995:
        return f"over 99.9{NO_BREAK_SPACE}%"
    return f"{100 * real:.1f}{NO_BREAK_SPACE}%" if real > 0.99 else format_percent(real)


def format_change(before: Any, after: Any) -> str:
    """Return by how many per cent a value changed; a dash where there was none to compare with."""
    old, new = _convert_real(before), _convert_real(after)
    if old is None or new is None or old == 0 or not (math.isfinite(old) and math.isfinite(new)):
        return NOTHING
    moved = 100 * (new - old) / abs(old)
    if abs(moved) < 0.05:
        return "unchanged"
    text = f"{moved:+.1f}" if abs(moved) < 10 else f"{moved:+.0f}"
    return _set_minus(text) + f"{NO_BREAK_SPACE}%"


def describe_improvement(before: Any, after: Any) -> str:
    """Return the factor by which an error fell or grew, in words."""
    old, new = _convert_real(before), _convert_real(after)
    if (
        old is None
        or new is None
        or not (math.isfinite(old) and math.isfinite(new))
        or old <= 0
        or new <= 0
    ):
        return NOTHING
    if abs(old / new - 1) < 0.005:
        return "the same"
    return (
        f"{render_number(old / new)} times smaller"
        if old > new
        else f"{render_number(new / old)} times larger"
    )


def format_intervals(intervals: Sequence[tuple[float, float]]) -> str:
    """Return the first stretches of a recording as "12.1–14.0 s"; a short one is an instant."""
    texts = [_format_span(begin, end) for begin, end in intervals]
    if not texts:
        return NOTHING
    more = f" and {len(texts) - MOST_INTERVALS} more" if len(texts) > MOST_INTERVALS else ""
    return f"{', '.join(texts[:MOST_INTERVALS])}{NO_BREAK_SPACE}s{more}"


def format_seconds(time_s: float) -> str:
    """Return a time in the recording with hundredths of a second, never as minus zero."""
    return _format_fixed(time_s, 2, 0)


def format_sentence(sentence: str) -> str:
    """Return a plain sentence of a verdict with the signs and powers of ten of a printed page."""
    for plain, sign in SIGNS.items():
        sentence = sentence.replace(plain, sign)
    sentence = POWER.sub(lambda number: number[1] + _format_power(int(number[2])), sentence)
    return NEGATIVE.sub("−", sentence)


def _convert_real(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, Real) or math.isnan(value):
        return None
    return float(value)


def _format_span(begin: float, end: float) -> str:
    return f"{begin:.1f}\u2013{end:.1f}" if end - begin >= SHORTEST_SPAN_S else f"{begin:.2f}"


def _compute_exponent(real: float) -> int:
    return math.floor(math.log10(abs(real))) if real and math.isfinite(real) else 0


def _count_decimals(half_width: float, exponent: int) -> int:
    """Return the decimals that show the first digit of the half-width, two of 1 or 2."""
    size = _compute_exponent(half_width)
    wanted = (1 if half_width < 3 * 10.0**size else 0) - size if half_width > 0 else 3 - exponent
    return min(max(wanted, 1 - exponent), MOST_DIGITS - 1 - exponent)


def _format_fixed(real: float, decimals: int, scale: int) -> str:
    if math.isinf(real):
        return "∞" if real > 0 else "−∞"
    places = max(decimals, 0)
    text = f"{real / 10.0**scale:,.{places}f}"
    if text.startswith("-") and not any(c in "123456789" for c in text):
        text = text[1:]
    return _set_minus(_group_digits(text))


def _group_digits(text: str) -> str:
    digits = text.split(".")[0].lstrip("-").replace(",", "")
    return text.replace(",", NARROW_SPACE if len(digits) > 4 else "")


def _set_minus(text: str) -> str:
    return text.replace("-", "−")


def _format_power(scale: int) -> str:
    return (
        f"{NO_BREAK_SPACE}×{NO_BREAK_SPACE}10{str(scale).translate(SUPERSCRIPTS)}" if scale else ""
    )
