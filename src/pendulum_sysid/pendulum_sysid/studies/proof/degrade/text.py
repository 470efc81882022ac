"""The tables of the study, as text."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid.studies.proof.degrade.kinds import BY_NAME
from pendulum_sysid.studies.proof.degrade.score import Score
from pendulum_sysid.studies.proof.degrade.study import Row, count_scores
from pendulum_sysid.telling.tables import format_table

RIGS = ("nothing", "single", "pair")


def format_rows(rows: Sequence[Row]) -> str:
    """Return a row a kind of degradation, the totals, and each wrong answer in words."""
    kinds = [name for name in BY_NAME if any(row.kind == name for row in rows)]
    table = [_make_row(BY_NAME[name].says, [r for r in rows if r.kind == name]) for name in kinds]
    table += [_make_row(f"all: {rig}", [r for r in rows if r.rig == rig]) for rig in RIGS]
    table.append(_make_row("all", rows))
    header = ("degradation", *(score.value for score in Score), "fault reported")
    wrong = [
        f"wrong: {row.kind}, rig {row.trial} ({', '.join(row.concealed) or 'nothing'}): {row.why}"
        for row in rows
        if row.score == Score.WRONG.value
    ]
    return "\n".join([format_table(header, table), *wrong])


def _make_row(says: str, rows: Sequence[Row]) -> tuple[str, ...]:
    counts = count_scores(rows)
    faulty = [row for row in rows if BY_NAME[row.kind].reported]
    count = sum(_is_reported(row) for row in faulty)
    reported = f"{count} of {len(faulty)}" if faulty else "-"
    return (says, *(str(counts[score]) for score in Score), reported)


def _is_reported(row: Row) -> bool:
    """Tell whether the fault is reported, or the recording refused."""
    return row.outcome == "unusable" or bool(set(row.reported) & set(BY_NAME[row.kind].reported))
