"""Write the tables of the decisions: what each is, and which verdicts change with it.

A page holds them between two marks; what stands around the marks is written by hand and stays.
"""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from pathlib import Path

from pendulum_sysid.studies.ablation.decision_list import FACTOR, Decision
from pendulum_sysid.studies.ablation.variation import AS_IT_IS, Tried
from pendulum_twin.errors import BadInputError

BEGIN, END = "<!-- ablation: begin -->\n", "<!-- ablation: end -->\n"
EMPTY_PAGE = f"# Decisions\n\n{BEGIN}{END}"
COLUMNS = 99  # of a line of prose
HEADER = """| decision | value | unit | why this value | up, or off | down |
|---|---|---|---|---|---|"""
CHANGED = """| decision | trial | as it is | becomes |
|---|---|---|---|"""


def read_page(path: Path) -> tuple[str, str]:
    """Return what stands before and behind the tables of a page; a missing page is begun.

    Raises BadInputError for a page without both marks, which would be overwritten.
    """
    page = path.read_text(encoding="utf-8") if path.exists() else EMPTY_PAGE
    if page.count(BEGIN) != 1 or END not in page.split(BEGIN)[1]:
        raise BadInputError(
            f"{path}: expected the marks {BEGIN.strip()} and {END.strip()}, between which the "
            "tables are written, found not both once: name another page (--out), or add them"
        )
    head, rest = page.split(BEGIN)
    return head, rest.split(END, 1)[1]


def write_page(path: Path, tables: str) -> None:
    """Write the tables between the marks of a page; the rest of the page stays."""
    head, tail = read_page(path)
    path.write_text(f"{head}{BEGIN}{tables}{END}{tail}", encoding="utf-8")


def render_tables(chosen: Sequence[Decision], tried: Sequence[Tried]) -> str:
    """Return the tables, in Markdown: a table a question, a row a decision."""
    plain = {t.trial: (t.outcome, t.names) for t in tried if t.variant == AS_IT_IS}
    changed = [t for t in tried if (t.outcome, t.names) != plain[t.trial]]
    seen = {(t.decision, t.variant) for t in tried if t.read}
    lines = [
        textwrap.fill(
            "`make ablate` writes from here to the end of 'What changed'. The last columns say "
            "how many verdicts (outcome, names of effects and laws) change on "
            f"{len(plain)} kept trial{'s' * (len(plain) != 1)} when the number is {FACTOR:g} "
            "times larger or smaller, or the rule is switched off. A dash: no verdict of these "
            "trials reads it, or it is newer than the table.",
            COLUMNS,
        ),
    ]
    for question in dict.fromkeys(decision.question for decision in chosen):
        lines += ["", f"## {question}", "", HEADER]
        lines += [_render_row(d, changed, seen) for d in chosen if d.question == question]
    lines += ["", "## What changed", "", CHANGED if changed else "On these trials: no verdict."]
    lines += [
        f"| `{t.decision}` {t.variant} | {t.trial} | {_render_answer(*plain[t.trial])} "
        f"| {_render_answer(t.outcome, t.names)} |"
        for t in sorted(changed, key=lambda t: (t.decision, t.variant, t.trial))
    ]
    return "\n".join(lines) + "\n"


def list_idle(chosen: Sequence[Decision], tried: Sequence[Tried]) -> list[str]:
    """Return the decisions that verdicts read and none of whose variants changes a verdict."""
    plain = {t.trial: (t.outcome, t.names) for t in tried if t.variant == AS_IT_IS}
    busy = {t.decision for t in tried if (t.outcome, t.names) != plain[t.trial]}
    read = {t.decision for t in tried if t.read}
    return [decision.name for decision in chosen if decision.name in read - busy]


def _render_row(decision: Decision, changed: Sequence[Tried], seen: set[tuple[str, str]]) -> str:
    def count(*variants: str) -> str:
        if not any((decision.name, variant) in seen for variant in variants):
            return "-"
        mine = [t for t in changed if t.decision == decision.name and t.variant in variants]
        return str(len(mine))

    cells = (f"`{decision.name}`", decision.words, decision.unit, decision.why, count("up", "off"))
    return "| " + " | ".join((*cells, count("down"))) + " |"


def _render_answer(outcome: str, names: Sequence[str]) -> str:
    return f"{outcome}: {', '.join(names)}" if names else outcome
