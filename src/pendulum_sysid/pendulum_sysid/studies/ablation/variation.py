"""Try every variant of every decision on a kept trial, and keep what each verdict came to."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid import decisions
from pendulum_sysid.studies.ablation.decision_list import Decision, Value
from pendulum_sysid.studies.ablation.memory import Memory
from pendulum_sysid.studies.ablation.trial_verdict import Diagnosis, Short

AS_IT_IS = "as it is"


@dataclass(frozen=True)
class Tried:
    """Hold what a trial's verdict came to under one variant of one decision.

    variant: "up", "down", "off", or `AS_IT_IS`, with an empty decision.
    outcome, names: of the verdict.
    read: whether the trial's verdict read the decision at all.
    """

    trial: str
    decision: str
    variant: str
    outcome: str
    names: tuple[str, ...]
    read: bool


def vary_decisions(folder: Path, chosen: Sequence[Decision], kept: Path) -> None:
    """Diagnose a trial under every variant, and append a line each to a file.

    A decision that is never read for this trial, or whose variant has been tried before, costs
    nothing.

    kept: JSON lines; read by `read_tried`.
    """
    done = {(t.decision, t.variant) for t in read_tried(kept) if t.trial == folder.name}
    todo = [(d, v) for d in chosen for v in d.variants if (d.name, v) not in done]
    if not todo:
        return
    memory = Memory()
    with memory.trace():
        diagnosis = Diagnosis(folder, memory)
        with memory.watch() as reads:
            plain = diagnosis.decide()
        _keep(kept, folder.name, "", AS_IT_IS, plain, True)
        for decision, variant in todo:
            answer, read = plain, decision.name in reads
            if read:
                with replace_decision(decision.name, decision.variants[variant]):
                    answer = diagnosis.decide()
            _keep(kept, folder.name, decision.name, variant, answer, read)


@contextmanager
def replace_decision(name: str, value: Value) -> Iterator[None]:
    """Give a decision another value meanwhile."""
    plain = vars(decisions)[name]
    setattr(decisions, name, value)
    try:
        yield
    finally:
        setattr(decisions, name, plain)


def read_tried(kept: Path) -> list[Tried]:
    """Return what was tried before; nothing when there is no file yet."""
    if not kept.exists():
        return []
    rows = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()]
    return [Tried(**{**row, "names": tuple(row["names"])}) for row in rows]


def _keep(kept: Path, trial: str, decision: str, variant: str, answer: Short, read: bool) -> None:
    row = {
        "trial": trial,
        "decision": decision,
        "variant": variant,
        "outcome": answer.outcome,
        "names": sorted(answer.names),
        "read": read,
    }
    with kept.open("a", encoding="utf-8") as file:
        file.write(json.dumps(row) + "\n")
