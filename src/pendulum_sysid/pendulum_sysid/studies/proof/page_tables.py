"""The tables of the proof's page, row by row."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from markupsafe import Markup

from pendulum_sysid.studies.proof.dose_response import Dose, Response
from pendulum_sysid.studies.proof.names import NOT_IN_CATALOGUE, NOT_NAMED, NOTHING
from pendulum_sysid.studies.proof.pictures import draw_scatter, draw_strip
from pendulum_sysid.studies.proof.proof_text import format_modelled
from pendulum_sysid.studies.proof.records import Judgement, NamesOutcome, Size
from pendulum_sysid.studies.proof.rival_models.table import list_models, list_unlisted
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.sizes import RIG
from pendulum_sysid.studies.proof.statistics import (
    ORACLE_FACTOR,
    Confusion,
    Quantiles,
    compute_coverage,
    compute_quantiles,
    list_ratios,
    scale_seconds,
)
from pendulum_sysid.telling.display import format_quantity
from pendulum_twin.effects import CATALOGUE

STRIP_ERROR = 0.05  # relative error at the edge of a strip: the target for the median

OUTCOME_LABELS: dict[NamesOutcome, str] = {
    NamesOutcome.RIGHT: "right",
    NamesOutcome.TIED: "right, by a tie",
    NamesOutcome.INCOMPLETE: "not all named",
    NamesOutcome.MISSED: "nothing named",
    NamesOutcome.ABSTAINED: "abstained",
    NamesOutcome.WRONG: "wrong name",
    NamesOutcome.FALSE_ALARM: "false alarm",
    NamesOutcome.CRASHED: "broke off",
}


@dataclass(frozen=True)
class SizeRow:
    """Hold one parameter over all trials.

    errors: relative errors, unsigned.
    inside: share of intervals that hold the truth.
    picture: signed relative errors as dots on a line.
    """

    name: str
    errors: Quantiles
    inside: Share
    picture: Markup


@dataclass(frozen=True)
class CellText:
    """Hold one cell of the confusion matrix: its text, and whether it is right or tied."""

    text: str
    right: bool
    tied: bool


@dataclass(frozen=True)
class TrialRow:
    """Hold one trial as the table shows it; ratio: held-out score / the oracle fit's."""

    name: str
    kind: str
    concealed: tuple[str, ...]
    answers: tuple[str, ...]
    outcome: str
    right: bool
    ratio: float | None
    seconds: float


def list_size_rows(sizes: Sequence[Size]) -> list[SizeRow]:
    """Return one row a parameter, in the catalogue's order, the rig's constants last."""
    order = {effect.name: k for k, effect in enumerate(CATALOGUE)}
    by_parameter: dict[tuple[str, str], list[Size]] = {}
    for size in sorted(sizes, key=lambda s: order.get(s.owner, len(order))):
        by_parameter.setdefault((size.owner, size.parameter), []).append(size)
    return [
        _make_size_row(parameter if owner == RIG else f"{owner}.{parameter}", same)
        for (owner, parameter), same in by_parameter.items()
    ]


def list_confusion_rows(matrix: Confusion) -> list[tuple[str, list[CellText]]]:
    """Return each row's name and cells; a cell is tied when a tie excuses all of its count."""
    return [
        (row, [_make_cell(matrix, row, column) for column in matrix.columns])
        for row in matrix.rows
    ]


def list_trial_rows(judgements: Sequence[Judgement]) -> list[TrialRow]:
    """Return every trial; trials that are not right come first."""
    rows = [_make_trial_row(judgement) for judgement in judgements]
    return sorted(rows, key=lambda row: (row.right, row.name))


def list_answers(judgement: Judgement) -> tuple[str, ...]:
    """Return what the diagnosis said: names with their ties, else how it ended; and the place."""
    answer = judgement.answer
    if answer.error:
        return (answer.error,)
    names = [
        f"{name} or {' or '.join(ties)}" if ties else name for name, ties in answer.named.items()
    ]
    places = []
    if answer.place and (judgement.trial.seal.unlisted or not names):
        places = [f"place: {answer.place}"]
    return (*(names or [answer.outcome.replace("_", " ")]), *places)


def list_factors(responses: Sequence[Response]) -> list[float]:
    """Return every factor that was tried, the largest first."""
    return sorted({dose.factor for r in responses for dose in r.doses}, reverse=True)


def list_dose_cells(response: Response, factors: Sequence[float]) -> list[Dose | None]:
    """Return the effect's dose at each factor; None where it was not tried."""
    by_factor = {dose.factor: dose for dose in response.doses}
    return [by_factor.get(factor) for factor in factors]


def list_held_out_rows(judgements: Sequence[Judgement]) -> list[tuple[str, Quantiles]]:
    """Return the held-out scores of each twin, of trials that the catalogue can explain."""
    scores = [j.held_out for j in judgements if not j.trial.seal.unlisted]
    return [
        ("the nominal twin", compute_quantiles(s.before for s in scores)),
        ("the improved twin", compute_quantiles(s.after for s in scores)),
        ("the oracle fit", compute_quantiles(s.oracle for s in scores)),
        ("noise floor (a perfect model)", compute_quantiles(s.floor for s in scores)),
        ("improved twin / oracle fit", compute_quantiles(list_ratios(judgements))),
    ]


def list_modelled_rows(judgements: Sequence[Judgement]) -> list[tuple[str, ...]]:
    """Return trial, physics, place, place in the answer, names and floors of every model."""
    unlisted = list_unlisted(judgements)
    models = list_models(unlisted)
    return [(j.trial.name, *format_modelled(j, models)) for j in unlisted]


def list_time_rows(judgements: Sequence[Judgement]) -> list[tuple[str, Quantiles, Quantiles]]:
    """Return kind of trial, wall time and CPU time, s; all kinds first."""
    kinds = dict.fromkeys(judgement.trial.kind for judgement in judgements)
    return [
        (kind or "all", scale_seconds(judgements, kind), scale_seconds(judgements, kind, cpu=True))
        for kind in (("", *kinds) if kinds else ())
    ]


def draw_held_out(judgements: Sequence[Judgement]) -> Markup:
    """Return the held-out scores of the improved twin against those of the oracle fit."""
    scores = [j.held_out for j in judgements if not j.trial.seal.unlisted]
    points = [(s.oracle, s.after) for s in scores if s.oracle is not None and s.after is not None]
    return Markup(
        draw_scatter(
            points, "score, oracle fit", "score, improved twin", ORACLE_FACTOR, "held-out"
        )
    )


def _make_size_row(name: str, sizes: Sequence[Size]) -> SizeRow:
    signed = [(size.value - size.true) / abs(size.true) for size in sizes if size.true]
    return SizeRow(
        name,
        compute_quantiles(size.relative_error for size in sizes),
        compute_coverage(sizes),
        Markup(draw_strip(signed, STRIP_ERROR, name, f"relative errors of {name}")),
    )


def _make_cell(matrix: Confusion, row: str, column: str) -> CellText:
    count, tied = matrix.counts.get((row, column), 0), matrix.tied.get((row, column), 0)
    unlisted = row.startswith("unlisted: ") and column == NOT_IN_CATALOGUE
    right = row == column or unlisted or (row == NOTHING and column == NOT_NAMED)
    return CellText(str(count) if count else "", right, bool(count) and tied == count)


def _make_trial_row(judgement: Judgement) -> TrialRow:
    seal = judgement.trial.seal
    concealed = [_format_effect(name, values) for name, values in seal.effects.items()]
    concealed += [f"unlisted: {effect.name} ({effect.place})" for effect in seal.unlisted]
    return TrialRow(
        name=judgement.trial.name,
        kind=judgement.trial.kind,
        concealed=tuple(concealed),
        answers=list_answers(judgement),
        outcome=OUTCOME_LABELS[judgement.names.outcome],
        right=judgement.names.outcome.is_right,
        ratio=judgement.held_out.ratio,
        seconds=judgement.seconds,
    )


def _format_effect(name: str, values: Mapping[str, float]) -> str:
    sizes = ", ".join(f"{key} {format_quantity(value, None)}" for key, value in values.items())
    return f"{name} ({sizes})" if sizes else name
