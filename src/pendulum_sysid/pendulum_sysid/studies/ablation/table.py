"""Write the table of the decisions: what each is, and which verdicts change with it."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from pendulum_sysid.studies.ablation.decision_list import FACTOR, Decision
from pendulum_sysid.studies.ablation.variation import AS_IT_IS, Tried

COLUMNS = 99  # of a line of prose
HEADER = """| decision | value | unit | why this value | up, or off | down |
|---|---|---|---|---|---|"""
CHANGED = """| decision | trial | as it is | becomes |
|---|---|---|---|"""


def render_table(chosen: Sequence[Decision], tried: Sequence[Tried]) -> str:
    """Return the page, in Markdown: a table a question, a row a decision."""
    plain = {t.trial: (t.outcome, t.names) for t in tried if t.variant == AS_IT_IS}
    changed = [t for t in tried if (t.outcome, t.names) != plain[t.trial]]
    seen = {(t.decision, t.variant) for t in tried if t.read}
    lines = [
        "# Decisions",
        "",
        textwrap.fill(
            "Every number and rule of `decisions.py` that decides something. The last columns say "
            f"how many verdicts (outcome and set of names) change on {len(plain)} kept trials "
            f"when the number is {FACTOR:g} times larger or smaller, or the rule is switched off. "
            "A dash: no verdict of these trials reads it. `make ablate` writes this page.",
            COLUMNS,
        ),
    ]
    for question in dict.fromkeys(decision.question for decision in chosen):
        lines += ["", f"## {question}", "", HEADER]
        lines += [_render_row(d, changed, seen) for d in chosen if d.question == question]
    lines += ["", "## What changed", "", CHANGED]
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
