"""Statistics over judged trials: shares with intervals, quantiles, and the confusion matrix."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from pendulum_sysid.studies.proof.names import (
    BESIDE,
    NOT_IN_CATALOGUE,
    NOT_NAMED,
    NOTHING,
    count_names,
)
from pendulum_sysid.studies.proof.records import (
    Judgement,
    NameCounts,
    NamesJudgement,
    NamesOutcome,
    Size,
)
from pendulum_sysid.studies.proof.share import Share, count_share
from pendulum_twin.effects import CATALOGUE

ORACLE_FACTOR = 1.2  # held-out score / the oracle fit's, at most in nine of ten trials
RECORDING_S = 60.0  # length to which times are scaled: they grow linearly with the length
DIAGNOSIS = "diagnosis"
LISTED_KINDS = ("single", "pair", "triple", "quadruple")


@dataclass(frozen=True)
class Quantiles:
    """Hold a number of values, their median, 90 % quantile and largest; None for no value."""

    count: int
    median: float | None
    high: float | None
    worst: float | None


def compute_quantiles(values: Iterable[float | None]) -> Quantiles:
    """Return the quantiles of the values that are not None."""
    present = [value for value in values if value is not None]
    if not present:
        return Quantiles(0, None, None, None)
    median, high, worst = (float(q) for q in np.quantile(present, (0.5, 0.9, 1.0)))
    return Quantiles(len(present), median, high, worst)


@dataclass(frozen=True)
class Method:
    """Hold how well one way of naming did.

    name: "diagnosis" or a rival's.
    right: kind of trial -> share of right names.
    false_alarms: of the trials in which nothing was concealed.
    misnamed: of the trials with physics that the catalogue does not have.
    wrong: wrong names, false alarms and crashes, of all trials.
    abstained: of all trials.
    seconds: wall time for a recording of 60 s, s.
    """

    name: str
    right: dict[str, Share]
    false_alarms: Share
    misnamed: Share
    wrong: Share
    abstained: Share
    seconds: Quantiles


def compare_methods(judgements: Sequence[Judgement]) -> list[Method]:
    """Return the diagnosis and every rival that was given all of these recordings."""
    rivals = [
        name
        for name in (judgements[0].rivals if judgements else ())
        if all(name in judgement.rivals for judgement in judgements)
    ]
    methods = [_summarise(DIAGNOSIS, judgements, lambda j: j.names, lambda j: j.seconds)]
    for name in rivals:
        methods.append(_summarise(name, judgements, *_make_rival_getters(name)))
    return methods


def _make_rival_getters(
    name: str,
) -> tuple[Callable[[Judgement], NamesJudgement], Callable[[Judgement], float]]:
    return lambda j: j.rivals[name].names, lambda j: j.rivals[name].seconds


def _summarise(
    name: str,
    judgements: Sequence[Judgement],
    get_names: Callable[[Judgement], NamesJudgement],
    get_seconds: Callable[[Judgement], float],
) -> Method:
    def count_outcomes(kind: str, *outcomes: NamesOutcome) -> Share:
        """Count the trials of a kind, or of all kinds, with one of these outcomes."""
        return count_share(
            get_names(judgement).outcome in outcomes
            for judgement in judgements
            if kind in ("", judgement.trial.kind)
        )

    wrong = (NamesOutcome.WRONG, NamesOutcome.FALSE_ALARM, NamesOutcome.CRASHED)
    return Method(
        name,
        {
            kind: count_outcomes(kind, NamesOutcome.RIGHT, NamesOutcome.TIED)
            for kind in (*LISTED_KINDS, "unlisted")
        },
        false_alarms=count_outcomes("nothing", NamesOutcome.FALSE_ALARM),
        misnamed=count_outcomes("unlisted", NamesOutcome.WRONG),
        wrong=count_outcomes("", *wrong),
        abstained=count_outcomes("", NamesOutcome.ABSTAINED),
        seconds=compute_quantiles(
            get_seconds(judgement) * RECORDING_S / judgement.trial.seconds
            for judgement in judgements
        ),
    )


def count_located(judgements: Sequence[Judgement]) -> Share:
    """Return the share of unlisted physics that was not misnamed and whose place is right."""
    return count_share(
        bool(judgement.names.located) and judgement.names.outcome.is_right
        for judgement in judgements
        if judgement.trial.seal.unlisted
    )


def count_modelled(judgements: Sequence[Judgement], most: float) -> Share:
    """Return the share of unlisted physics whose twin runs within so many floors elsewhere."""
    return count_share(
        judgement.modelled is not None and judgement.modelled <= most
        for judgement in judgements
        if judgement.trial.seal.unlisted
    )


def count_depends(judgements: Sequence[Judgement]) -> Share:
    """Return the share of unlisted physics with one of its variables in the evidence."""
    return count_share(
        bool(judgement.names.depends) for judgement in judgements if judgement.trial.seal.unlisted
    )


def count_all_names(judgements: Iterable[Judgement]) -> NameCounts:
    """Return the counts of names over all recordings, the second ones of rigs, too."""
    counts = NameCounts()
    for judgement in judgements:
        seal, pair = judgement.trial.seal, judgement.pair
        answers = [judgement.answer] + ([] if pair is None else [pair.answer])
        for answer in answers:
            counts += count_names(seal, answer)
    return counts


@dataclass(frozen=True)
class Pairs:
    """Hold how the answers to two recordings of each rig agree, as shares.

    names: pairs that name the same effects, up to their own ties.
    overlap: sizes that both give, whose intervals overlap.
    truth: intervals of both that hold the truth.
    better: pairs whose improved twin runs no worse on the other recording than the nominal twin.
    """

    names: Share
    overlap: Share
    truth: Share
    better: Share


def count_pairs(judgements: Sequence[Judgement]) -> Pairs | None:
    """Return how the answers to two recordings agree; None where no rig was recorded twice."""
    both = [(judgement, judgement.pair) for judgement in judgements if judgement.pair is not None]
    if not both:
        return None
    common = [size for _, pair in both for size in pair.common]
    return Pairs(
        names=count_share(pair.agree for _, pair in both),
        overlap=count_share(a.low <= b.high and b.low <= a.high for a, b in common),
        truth=count_share(
            size.inside for judgement, pair in both for size in (*judgement.sizes, *pair.sizes)
        ),
        better=count_share(pair.is_better for _, pair in both),
    )


def collect_sizes(judgements: Iterable[Judgement], shape: bool = False) -> list[Size]:
    """Return the sizes of concealed effects, of trials whose names are right.

    shape: return the parameters that say where and how, and not those that say how much.
    """
    return [
        size
        for judgement in judgements
        if judgement.names.outcome is NamesOutcome.RIGHT
        for size in judgement.sizes
        if size.shape == shape
    ]


def collect_rig_constants(judgements: Iterable[Judgement]) -> list[Size]:
    """Return the rig's constants, of trials whose names are right and in the catalogue.

    The intervals of a wrong model promise nothing.
    """
    return [
        size
        for judgement in judgements
        if judgement.names.outcome is NamesOutcome.RIGHT and not judgement.trial.seal.unlisted
        for size in judgement.rig
    ]


def compute_coverage(sizes: Iterable[Size]) -> Share:
    """Return the share of intervals that hold the truth."""
    return count_share(size.inside for size in sizes)


def list_ratios(judgements: Iterable[Judgement]) -> list[float]:
    """Return held-out score / the oracle fit's, of trials that the catalogue can explain."""
    return [
        judgement.held_out.ratio
        for judgement in judgements
        if not judgement.trial.seal.unlisted and judgement.held_out.ratio is not None
    ]


def scale_seconds(judgements: Iterable[Judgement], kind: str = "", cpu: bool = False) -> Quantiles:
    """Return the times of a diagnosis, scaled to a recording of 60 s, s.

    kind: of trial; all kinds when empty.
    cpu: whether CPU time is meant and not wall time.
    """
    return compute_quantiles(
        (judgement.cpu_seconds if cpu else judgement.seconds)
        * RECORDING_S
        / judgement.trial.seconds
        for judgement in judgements
        if kind in ("", judgement.trial.kind)
    )


@dataclass(frozen=True)
class Confusion:
    """Hold which concealed effect was taken for which.

    rows: concealed effects, and the stand-ins of `names`.
    columns: named effects, and the stand-ins of `names`.
    counts: (row, column) -> number of trials.
    tied: (row, column) -> how many of them are excused by a tie.
    """

    rows: tuple[str, ...]
    columns: tuple[str, ...]
    counts: dict[tuple[str, str], int]
    tied: dict[tuple[str, str], int]


def count_confusion(judgements: Iterable[Judgement]) -> Confusion:
    """Return the confusion matrix in the catalogue's order, stand-ins last."""
    cells = [cell for judgement in judgements for cell in judgement.names.cells]
    counts = Counter((cell.concealed, cell.named) for cell in cells)
    tied = Counter((cell.concealed, cell.named) for cell in cells if cell.tied)
    known = [effect.name for effect in CATALOGUE]
    rows, columns = {concealed for concealed, _ in counts}, {named for _, named in counts}
    unlisted = sorted(row for row in rows if row not in (*known, NOTHING, BESIDE))
    return Confusion(
        tuple(name for name in (*known, *unlisted, BESIDE, NOTHING) if name in rows),
        tuple(name for name in (*known, NOT_IN_CATALOGUE, NOT_NAMED) if name in columns),
        dict(counts),
        dict(tied),
    )
