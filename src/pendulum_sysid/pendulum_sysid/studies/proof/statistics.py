"""What many judged trials come to: shares with intervals, quantiles, and who was taken for whom."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.studies.proof.names import BESIDE, NOT_IN_CATALOGUE, NOT_NAMED, NOTHING
from pendulum_sysid.studies.proof.records import Judgement, NamesJudgement, NamesOutcome, Size
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_twin.effects import CATALOGUE

WITHIN = 1.2  # times the held-out score of a fit that was told the truth
RECORDING_S = 60.0  # to which seconds of diagnosis are scaled: they grow linearly with the length
DIAGNOSIS = "diagnosis"


@dataclass(frozen=True)
class Quantiles:
    """Hold how many values there are, their median, 90 % quantile and largest; None of none."""

    count: int
    median: float | None
    high: float | None
    worst: float | None


def compute_quantiles(values: Iterable[float | None]) -> Quantiles:
    """Return the quantiles of those values that are there."""
    there = [one for one in values if one is not None]
    if not there:
        return Quantiles(0, None, None, None)
    return Quantiles(len(there), *(float(np.quantile(there, q)) for q in (0.5, 0.9, 1.0)))


@dataclass(frozen=True)
class Method:
    """Hold how one way of naming did: right by kind, and what else came of it; seconds for a recording of 60 s.

    false_alarms, misnamed: where nothing, or nothing that the catalogue has, was hidden. wrong: of
    all trials.
    """

    name: str
    right: dict[str, Share]
    false_alarms: Share
    misnamed: Share
    wrong: Share
    abstained: Share
    seconds: Quantiles


def compare_methods(judged: Sequence[Judgement]) -> list[Method]:
    """Return the diagnosis and every rival that saw all of these recordings."""
    rivals = [
        name
        for name in (judged[0].rivals if judged else ())
        if all(name in one.rivals for one in judged)
    ]
    found = [_method(DIAGNOSIS, judged, lambda one: one.names, lambda one: one.seconds)]
    for name in rivals:
        found.append(_method(name, judged, *_of_rival(name)))
    return found


def _of_rival(
    name: str,
) -> tuple[Callable[[Judgement], NamesJudgement], Callable[[Judgement], float]]:
    return lambda one: one.rivals[name].names, lambda one: one.rivals[name].seconds


def _method(
    name: str,
    judged: Sequence[Judgement],
    names: Callable[[Judgement], NamesJudgement],
    seconds: Callable[[Judgement], float],
) -> Method:
    def of(kind: str, *hows: NamesOutcome) -> Share:
        return count_share(
            names(one).how in hows for one in judged if kind in ("", one.sealed.kind)
        )

    listed = ("single", "pair", "triple")
    return Method(
        name,
        {kind: of(kind, NamesOutcome.RIGHT, NamesOutcome.TIED) for kind in (*listed, "unlisted")},
        of("nothing", NamesOutcome.FALSE_ALARM),
        of("unlisted", NamesOutcome.WRONG),
        of("", NamesOutcome.WRONG, NamesOutcome.FALSE_ALARM, NamesOutcome.CRASHED),
        of("", NamesOutcome.ABSTAINED),
        compute_quantiles(seconds(one) * RECORDING_S / one.sealed.seconds for one in judged),
    )


def count_located(judged: Sequence[Judgement]) -> Share:
    """Return in how many trials with unlisted physics it was not forced onto a name and its place was right."""
    return count_share(
        bool(one.names.located) and one.names.how.right for one in _unlisted(judged)
    )


def count_depends(judged: Sequence[Judgement]) -> Share:
    """Return in how many trials with unlisted physics the evidence holds a variable that it depends on."""
    return count_share(bool(one.names.depends) for one in _unlisted(judged))


def _unlisted(judged: Sequence[Judgement]) -> list[Judgement]:
    return [one for one in judged if one.sealed.unlisted]


def collect_sizes(judged: Iterable[Judgement], shape: bool = False) -> list[Size]:
    """Return the sizes of concealed effects in trials whose names are right: how much or, with shape, where and how."""
    return [
        size
        for one in judged
        if one.names.how is NamesOutcome.RIGHT
        for size in one.sizes
        if size.shape == shape
    ]


def collect_rig_constants(judged: Iterable[Judgement]) -> list[Size]:
    """Return the rig's constants where the catalogue has all and all is named: a wrong model's intervals promise nothing."""
    return [
        size
        for one in judged
        if one.names.how is NamesOutcome.RIGHT and not one.sealed.unlisted
        for size in one.rig
    ]


def compute_coverage(sizes: Iterable[Size]) -> Share:
    """Return how many intervals hold the truth."""
    return count_share(one.inside for one in sizes)


def list_ratios(judged: Iterable[Judgement]) -> list[float]:
    """Return held-out score / that of a fit that was told the truth, of trials that the catalogue can explain."""
    return [
        one.held_out.ratio
        for one in judged
        if not one.sealed.unlisted and one.held_out.ratio is not None
    ]


def scale_seconds(judged: Iterable[Judgement], kind: str = "", cpu: bool = False) -> Quantiles:
    """Return the seconds that a diagnosis of a recording of 60 s takes, of one kind of trial or of all.

    cpu: those that its thread worked, not those of the clock.
    """
    asked = [one for one in judged if kind in ("", one.sealed.kind)]
    return compute_quantiles(
        (one.cpu_seconds if cpu else one.seconds) * RECORDING_S / one.sealed.seconds
        for one in asked
    )


@dataclass(frozen=True)
class Confusion:
    """Hold who was taken for whom: counts by (concealed, named), and how many of each are excused by a tie."""

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: dict[tuple[str, str], int]
    tied: dict[tuple[str, str], int]


def count_confusion(judged: Iterable[Judgement]) -> Confusion:
    """Return the confusion matrix, rows and columns in the catalogue's order, what is not an effect last."""
    cells = [cell for one in judged for cell in one.names.cells]
    counts = Counter((cell.concealed, cell.named) for cell in cells)
    tied = Counter((cell.concealed, cell.named) for cell in cells if cell.tied)
    known = [effect.name for effect in CATALOGUE]
    rows, columns = {concealed for concealed, _ in counts}, {named for _, named in counts}
    others = sorted(row for row in rows if row not in known and row not in (NOTHING, BESIDE))
    return Confusion(
        tuple(name for name in (*known, *others, BESIDE, NOTHING) if name in rows),
        tuple(name for name in (*known, NOT_IN_CATALOGUE, NOT_NAMED) if name in columns),
        dict(counts),
        dict(tied),
    )
