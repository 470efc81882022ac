"""Dose-response: every effect is made smaller and smaller until it is not found any more."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.studies.proof.records import Judgement, Size
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_twin.effects import BY_NAME, CATALOGUE

FACTORS = tuple(4.0**-k for k in range(6))
LEAST_SHARE_FOUND = 0.5  # of the tries at a size, for the effect to count as found there

RunSets = Callable[[Sequence[str], float], list[Judgement]]


@dataclass(frozen=True)
class Dose:
    """Hold the tries of one effect at one size.

    effect: the effect's name.
    factor: what the drawn sizes were multiplied by.
    named: share of the tries in which the effect was named.
    parameter: the effect's parameter that stands out most; empty for none.
    unit: SI unit of the parameter.
    size: median of the true sizes, in the unit; None for none.
    half_widths: median distance of the true size from neutral, in half widths of the oracle
        fit's interval; None for none.
    """

    effect: str
    factor: float
    named: Share
    parameter: str
    unit: str
    size: float | None
    half_widths: float | None


@dataclass(frozen=True)
class Response:
    """Hold an effect's doses, the largest first, and the smallest at which it is still found."""

    effect: str
    doses: tuple[Dose, ...]
    least: Dose | None


def list_dosed_sets() -> list[str]:
    """Return the sets, "a+b", whose last effect has a size that can be made smaller."""
    effects = [
        effect for effect in CATALOGUE if (effect.searched or effect.shows_as) and effect.sizes
    ]
    return ["+".join([*filter(None, [effect.acts_beside]), effect.name]) for effect in effects]


def measure_responses(
    run_sets: RunSets, sets: Sequence[str], factors: Sequence[float] = FACTORS
) -> list[Response]:
    """Return each effect's response.

    The factors are tried from the largest down until the effect is not found in any try. Then it
    is tried once more between the last two factors, at their geometric mean.

    run_sets: records and judges trials of these sets with sizes times a factor.
    sets: "a+b", the last effect being the one whose size is studied.
    """
    doses: dict[str, list[Dose]] = {effects: [] for effects in sets}

    def add(chosen: Sequence[str], factor: float) -> None:
        judgements = run_sets(chosen, factor) if chosen else []
        for effects in chosen:
            tries = [j for j in judgements if set(j.trial.seal.effects) == {*effects.split("+")}]
            doses[effects].append(measure_dose(_name_studied(effects), factor, tries))

    for factor in factors:
        add([s for s in sets if not doses[s] or doses[s][-1].named.hits], factor)
    lost_at = {
        effects: tried[-1].factor
        for effects, tried in doses.items()
        if len(tried) > 1 and not tried[-1].named.hits
    }
    for above, below in itertools.pairwise(factors):
        add([s for s in sets if lost_at.get(s) == below], math.sqrt(above * below))
    return [_make_response(_name_studied(effects), tried) for effects, tried in doses.items()]


def find_least(doses: Iterable[Dose]) -> Dose | None:
    """Return the smallest dose at which it and all larger ones are found; None for none.

    doses: the largest first.
    """
    larger = itertools.takewhile(
        lambda dose: dose.named.value is not None and dose.named.value >= LEAST_SHARE_FOUND, doses
    )
    return min(larger, key=lambda dose: dose.factor, default=None)


def measure_dose(effect: str, factor: float, judgements: Sequence[Judgement]) -> Dose:
    """Return what trials of one effect at one size came to."""
    sizes = [
        size
        for judgement in judgements
        for size in judgement.oracle
        if size.owner == effect and not size.shape
    ]
    distances = {
        p.name: [_count_half_widths(p.neutral, s) for s in sizes if s.parameter == p.name]
        for p in BY_NAME[effect].parameters
    }
    medians = {name: float(np.median(values)) for name, values in distances.items() if values}
    parameter = max(medians, key=lambda name: medians[name], default="")
    chosen = [size for size in sizes if size.parameter == parameter]
    return Dose(
        effect,
        factor,
        count_share(_is_named(effect, judgement) for judgement in judgements),
        parameter,
        chosen[0].unit if chosen else "",
        float(np.median([abs(size.true) for size in chosen])) if chosen else None,
        medians.get(parameter),
    )


def _make_response(effect: str, doses: Sequence[Dose]) -> Response:
    ordered = tuple(sorted(doses, key=lambda dose: -dose.factor))
    return Response(effect, ordered, find_least(ordered))


def _count_half_widths(neutral: float, size: Size) -> float:
    return abs(size.true - neutral) / size.half_width if size.half_width > 0 else np.inf


def _is_named(effect: str, judgement: Judgement) -> bool:
    return any(
        cell.concealed == effect and (cell.named == effect or cell.tied)
        for cell in judgement.names.cells
    )


def _name_studied(effects: str) -> str:
    """Return the effect of a set whose size is studied: the last."""
    return effects.split("+")[-1]
