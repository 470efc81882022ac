"""What the page shows, row by row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from pendulum_sysid.studies.proof import statistics
from pendulum_sysid.studies.proof.dose_response import Dose, Response
from pendulum_sysid.studies.proof.names import NOT_IN_CATALOGUE, NOT_NAMED, NOTHING
from pendulum_sysid.studies.proof.pictures import draw_scatter, draw_strip
from pendulum_sysid.studies.proof.records import Judgement, NamesOutcome, Size
from pendulum_sysid.studies.proof.share import Share
from pendulum_sysid.studies.proof.statistics import Confusion, Quantiles
from pendulum_sysid.telling.display import quantity
from pendulum_twin.effects import CATALOGUE

SHOWN_ERROR = 0.05  # relative error at the edge of a strip: the mark for the median

HOW_WORDS: dict[NamesOutcome, str] = {
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
    """Hold one parameter over all trials: its relative errors, its intervals that hold the truth, a strip of dots."""

    name: str
    errors: Quantiles
    inside: Share
    picture: Markup


@dataclass(frozen=True)
class CellShown:
    """Hold one entry of the confusion matrix: its text, how dark, whether it is the right one or excused."""

    text: str
    right: bool
    tied: bool


@dataclass(frozen=True)
class TrialRow:
    """Hold one trial as the table shows it."""

    name: str
    kind: str
    concealed: tuple[str, ...]
    answered: tuple[str, ...]
    how: str
    right: bool
    ratio: float | None
    seconds: float


def list_size_rows(sizes: Sequence[Size]) -> list[SizeRow]:
    """Return one row a parameter, in the catalogue's order, constants of the rig after the effects."""
    order = {effect.name: k for k, effect in enumerate(CATALOGUE)}
    names = dict.fromkeys(
        (size.owner, size.parameter)
        for size in sorted(sizes, key=lambda s: order.get(s.owner, len(order)))
    )
    return [
        _size_row([one for one in sizes if (one.owner, one.parameter) == name]) for name in names
    ]


def _size_row(same: list[Size]) -> SizeRow:
    first = same[0]
    name = first.parameter if first.owner == "rig" else f"{first.owner}.{first.parameter}"
    signed = [(one.value - one.true) / abs(one.true) for one in same if one.true]
    drawn = draw_strip(signed, SHOWN_ERROR, f"relative errors of {name}")
    return SizeRow(
        name,
        statistics.compute_quantiles(one.error for one in same),
        statistics.compute_coverage(same),
        Markup(drawn),
    )


def list_confusion_rows(matrix: Confusion) -> list[tuple[str, list[CellShown]]]:
    """Return each row's name and cells; a cell of the diagonal is right, one that a tie excuses is marked."""
    found = []
    for row in matrix.rows:
        cells = []
        for column in matrix.columns:
            count, tied = matrix.counts.get((row, column), 0), matrix.tied.get((row, column), 0)
            cells.append(
                CellShown(
                    str(count) if count else "", _right(row, column), bool(count) and tied == count
                )
            )
        found.append((row, cells))
    return found


def _right(row: str, column: str) -> bool:
    unlisted = row.startswith("unlisted: ") and column == NOT_IN_CATALOGUE
    return row == column or unlisted or (row == NOTHING and column == NOT_NAMED)


def list_trial_rows(judged: Sequence[Judgement]) -> list[TrialRow]:
    """Return every trial, those that are not right first."""
    return sorted((_trial_row(one) for one in judged), key=lambda row: (row.right, row.name))


def _trial_row(one: Judgement) -> TrialRow:
    concealed = [_with_sizes(name, values) for name, values in one.sealed.effects.items()]
    concealed += [f"unlisted: {each.name} ({each.place})" for each in one.sealed.unlisted]
    return TrialRow(
        one.sealed.name,
        one.sealed.kind,
        tuple(concealed),
        list_answers(one),
        HOW_WORDS[one.names.how],
        one.names.how.right,
        one.held_out.ratio,
        one.seconds,
    )


def _with_sizes(name: str, values: object) -> str:
    assert isinstance(values, dict)
    sizes = ", ".join(f"{key} {quantity(value, None)}" for key, value in values.items())
    return f"{name} ({sizes})" if sizes else name


def list_answers(one: Judgement) -> tuple[str, ...]:
    """Return what the diagnosis said: its names with their ties, or how it ended without any."""
    answer = one.answer
    if answer.error:
        return (answer.error,)
    names = [
        f"{name} or {' or '.join(ties)}" if ties else name for name, ties in answer.named.items()
    ]
    place = (
        [f"place: {answer.place}"] if answer.place and (one.sealed.unlisted or not names) else []
    )
    return (*(names or [answer.outcome.replace("_", " ")]), *place)


def list_factors(responses: Sequence[Response]) -> list[float]:
    """Return every factor that was asked, the largest first."""
    return sorted({dose.factor for one in responses for dose in one.doses}, reverse=True)


def list_dose_cells(one: Response, responses: Sequence[Response]) -> list[Dose | None]:
    """Return the effect's dose at each factor, None where it was not asked."""
    by_factor = {dose.factor: dose for dose in one.doses}
    return [by_factor.get(factor) for factor in list_factors(responses)]


def draw_held_out(judged: Sequence[Judgement]) -> Markup:
    """Return the held-out scores of the diagnosis against those of the fit that was told the truth."""
    scores = [one.held_out for one in judged if not one.sealed.unlisted]
    points = [
        (one.told, one.after) for one in scores if one.told is not None and one.after is not None
    ]
    return Markup(
        draw_scatter(
            points,
            "score, told the truth",
            "score after diagnosis",
            statistics.WITHIN,
            "held-out scores of both fits",
        )
    )
