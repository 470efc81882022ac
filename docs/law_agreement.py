"""Compare a measured law of two recordings where both have measured it.

What counts is the whole curve: a part that an effect of the verdict holds is added to the law.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

import pendulum_sysid as ps
from pendulum_sysid.finding.naming import is_left_parts
from pendulum_sysid.measuring.curve import PARTS
from pendulum_sysid.verdict.record import MeasuredLaw
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME

PLACES = 201  # evenly over what both recordings visited


@dataclass(frozen=True)
class Agreement:
    """Hold how far the curves of one law agree that two parts have measured apart.

    law: kind of the law.
    parts: names of both parts.
    common: of the range that either part visited: the share that both visited.
    overlap: of the places that both visited: the share where their bands overlap.
    apart: median distance of the curves there, divided by the larger half width of the bands.
    """

    law: str
    parts: tuple[str, str]
    common: float
    overlap: float
    apart: float


def list_agreements(verdicts: dict[str, ps.Verdict], group: tuple[str, ...]) -> list[Agreement]:
    """Return the agreement of every law that two parts of a group have measured, both apart.

    verdicts: name of the part -> its verdict.
    group: names of parts that share no time.
    """
    agreements = []
    for first, second in combinations([part for part in group if part in verdicts], 2):
        others = {law.law: law for law in verdicts[second].measured_laws}
        for law in verdicts[first].measured_laws:
            if law.law in others:
                whole = add_parts(law, verdicts[first])
                other = add_parts(others[law.law], verdicts[second])
                agreements.append(compare_laws(whole, other, (first, second)))
    return agreements


def add_parts(law: MeasuredLaw, verdict: ps.Verdict) -> MeasuredLaw:
    """Return a law with the parts of its curve that effects of the same verdict hold.

    Beside an offset of the angle, say, an error of the angle has a mean of 0.
    """
    values, below, above = _list_ends(law)
    knots = np.array(law.knots)
    for missing in (*verdict.missing_physics, *verdict.perhaps):
        effect = BY_NAME[missing.effect]
        if not is_left_parts(effect.name, [law.law]):
            continue
        for part, parameter in zip(effect.law_parts, effect.parameters, strict=False):
            size, shape = missing.parameters[parameter.name], PARTS[part](knots)
            values = values + shape * size.value
            ends = [shape * (size.low - size.value), shape * (size.high - size.value)]
            lower, upper = np.sort(ends, axis=0)  # a negative shape turns the interval round
            below, above = np.hypot(below, lower), np.hypot(above, upper)
    return replace(
        law,
        values=tuple(values.tolist()),
        low=tuple((values - below).tolist()),
        high=tuple((values + above).tolist()),
    )


def _list_ends(law: MeasuredLaw) -> tuple[Floats, Floats, Floats]:
    """Return the values of a law, and how far its band reaches below and above."""
    values, low, high = (np.array(ends) for ends in (law.values, law.low, law.high))
    return values, values - low, high - values


def compare_laws(first: MeasuredLaw, second: MeasuredLaw, parts: tuple[str, str]) -> Agreement:
    """Return how far two curves of one law agree."""
    ends = [(law.knots[0], law.knots[-1]) for law in (first, second)]
    low, high = max(end[0] for end in ends), min(end[1] for end in ends)
    length = max(end[1] for end in ends) - min(end[0] for end in ends)
    if high <= low:
        return Agreement(first.law, parts, 0.0, np.nan, np.nan)
    places = np.linspace(low, high, PLACES)
    curves = [_read_band(law, places) for law in (first, second)]
    (value, least, most), (other, other_least, other_most) = curves
    overlap = (least <= other_most) & (other_least <= most)
    half_width = 0.5 * np.maximum(most - least, other_most - other_least)
    apart = np.median(np.abs(value - other) / np.maximum(half_width, 1e-300))
    return Agreement(
        first.law, parts, (high - low) / length, float(np.mean(overlap)), float(apart)
    )


def _read_band(law: MeasuredLaw, places: Floats) -> tuple[Floats, ...]:
    """Return a law's values, and the ends of its band, at places."""
    return tuple(np.interp(places, law.knots, ends) for ends in (law.values, law.low, law.high))


def format_agreements(agreements: list[Agreement]) -> str:
    """Return a Markdown table; a sentence where no law was measured in two parts."""
    if not agreements:
        return "No law was measured in two parts."
    lines = [
        "| law | parts | range that both visited | bands overlap | curves apart, half widths |",
        "|---|---|---|---|---|",
    ]
    for each in agreements:
        shares = f"{each.common:.0%} | {each.overlap:.0%} | {each.apart:.2g}"
        lines.append(f"| `{each.law}` | {' and '.join(each.parts)} | {shares} |")
    return "\n".join(lines)
