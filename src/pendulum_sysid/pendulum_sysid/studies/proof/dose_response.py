"""Dose-response: every effect made smaller and smaller, until it is not found any more."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.studies.proof.records import Judgement, Size
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Form

FACTORS = tuple(4.0**-k for k in range(6))
BESIDE = {Form.DRY_RATIO: "cart_coulomb_friction"}  # what an effect needs beside it to show at all

Ask = Callable[[Sequence[str], float], list[Judgement]]


@dataclass(frozen=True)
class Dose:
    """Hold one effect at one size: how often it was found, its typical size, and that in half widths of its interval.

    parameter, unit, size: the effect's clearest parameter and the median of its true sizes.
    half_widths: median distance of that from neutral, in half widths of the interval of a fit that
    was told what is there.
    """

    effect: str
    factor: float
    found: Share
    parameter: str
    unit: str
    size: float | None
    half_widths: float | None


@dataclass(frozen=True)
class Response:
    """Hold an effect's doses, the largest first, and the smallest at which it is still found (None for none)."""

    effect: str
    doses: tuple[Dose, ...]
    least: Dose | None


def list_dosed_sets() -> list[str]:
    """Return the sets, "a+b", whose effects have a size that can be made smaller."""
    effects = [
        e
        for e in CATALOGUE
        if (e.searched or e.shows_as) and any(not p.shape for p in e.parameters)
    ]
    return [f"{BESIDE[e.form]}+{e.name}" if e.form in BESIDE else e.name for e in effects]


def measure_responses(
    ask: Ask, sets: Sequence[str], factors: Sequence[float] = FACTORS
) -> list[Response]:
    """Return each effect's response, the factors asked from the largest down until it is not found once.

    Then it is asked for once more between the last two, at their geometric mean. ask: records and
    judges these sets with sizes times a factor, some recordings each.
    """
    doses: dict[str, list[Dose]] = {one: [] for one in sets}

    def add(some: Sequence[str], factor: float) -> None:
        judged = ask(some, factor) if some else []
        for one in some:
            same = [each for each in judged if set(each.sealed.effects) == set(one.split("+"))]
            doses[one].append(measure_dose(_asked_for(one), factor, same))

    for factor in factors:
        add([one for one in sets if not doses[one] or doses[one][-1].found.hits], factor)
    lost = {
        one: found[-1].factor
        for one, found in doses.items()
        if len(found) > 1 and not found[-1].found.hits
    }
    for above, below in itertools.pairwise(factors):
        add([one for one in sets if lost.get(one) == below], math.sqrt(above * below))
    return [_response(_asked_for(one), found) for one, found in doses.items()]


def _response(effect: str, doses: Sequence[Dose]) -> Response:
    ordered = tuple(sorted(doses, key=lambda one: -one.factor))
    return Response(effect, ordered, find_least(ordered))


def find_least(doses: Iterable[Dose]) -> Dose | None:
    """Return the smallest of doses, the largest first, found in at least half of the tries, as all larger ones are."""
    last = None
    for one in doses:
        if one.found.value is None or one.found.value < 0.5:
            break
        last = one
    return last


def measure_dose(effect: str, factor: float, judged: Sequence[Judgement]) -> Dose:
    """Return what these recordings of one effect at one size came to."""
    sizes = [
        size for one in judged for size in one.told if size.owner == effect and not size.shape
    ]
    far = {
        p.name: [_half_widths(p.neutral, s) for s in sizes if s.parameter == p.name]
        for p in BY_NAME[effect].parameters
    }
    clear = {name: float(np.median(values)) for name, values in far.items() if values}
    parameter = max(clear, key=lambda name: clear[name], default="")
    true = [abs(size.true) for size in sizes if size.parameter == parameter]
    unit = next((size.unit for size in sizes if size.parameter == parameter), "")
    found = count_share(_found(effect, one) for one in judged)
    return Dose(
        effect,
        factor,
        found,
        parameter,
        unit,
        float(np.median(true)) if true else None,
        clear.get(parameter),
    )


def _half_widths(neutral: float, size: Size) -> float:
    return abs(size.true - neutral) / size.half_width if size.half_width > 0 else np.inf


def _found(effect: str, one: Judgement) -> bool:
    return any(
        cell.concealed == effect and (cell.named == effect or cell.tied)
        for cell in one.names.cells
    )


def _asked_for(one: str) -> str:
    return one.split("+")[-1]
