"""Try every variant of every decision on a kept trial, and keep what each verdict came to."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path

from pendulum_sysid import decisions
from pendulum_sysid.studies.ablation.decision_list import Decision, Value
from pendulum_sysid.studies.ablation.memory import Memory
from pendulum_sysid.studies.ablation.trial_verdict import Diagnosis, Short
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import compute_digest, describe_read_error

AS_IT_IS = "as it is"


@dataclass(frozen=True)
class Tried:
    """Hold what a trial's verdict came to under one variant of one decision.

    variant: "up", "down", "off", or `AS_IT_IS`, with an empty decision.
    outcome, names: of the verdict.
    read: whether the trial's verdict read the decision at all.
    digest: of the trial's recording and twin; empty in files that do not say.
    """

    trial: str
    decision: str
    variant: str
    outcome: str
    names: tuple[str, ...]
    read: bool
    digest: str = ""


def vary_decisions(folder: Path, chosen: Sequence[Decision], kept: Path) -> None:
    """Diagnose a trial under every variant, and append a line each to a file.

    A decision that is never read for this trial, or whose variant has been tried before, costs
    nothing.

    kept: JSON lines; read by `read_tried`.
    Raises BadInputError where the file holds what was tried on another trial of this name.
    """
    earlier = [t for t in read_tried(kept) if t.trial == folder.name]
    digest = compute_trial_digest(folder)
    if any(t.digest not in ("", digest) for t in earlier):
        raise BadInputError(
            f"{kept}: expected what was tried on {folder}, found tries of another recording or "
            "twin of this name: name another file (--kept), or remove it"
        )
    done = {(t.decision, t.variant) for t in earlier}
    todo = [(d, v) for d in chosen for v in d.variants if (d.name, v) not in done]
    if not todo:
        return
    memory = Memory()
    with memory.trace():
        diagnosis = Diagnosis(folder, memory)
        with memory.watch() as reads:
            plain = diagnosis.decide()
        _keep(kept, _describe(folder.name, "", AS_IT_IS, plain, True, digest))
        for decision, variant in todo:
            answer, read = plain, decision.name in reads
            if read:
                with replace_decision(decision.name, decision.variants[variant]):
                    answer = diagnosis.decide()
            _keep(kept, _describe(folder.name, decision.name, variant, answer, read, digest))


def compute_trial_digest(folder: Path) -> str:
    """Return "sha256:..." over the recording and the twin of a trial.

    Raises BadInputError where one of them cannot be read.
    """
    try:
        files = [file for file in (folder / "bag").iterdir() if file.is_file()]
        return compute_digest([*files, folder / "twin.yaml"])
    except OSError as error:
        raise BadInputError(
            f"{folder}: expected a trial with its recording and twin, found it unreadable: "
            f"{describe_read_error(error)}"
        ) from error


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


def _describe(
    trial: str, decision: str, variant: str, answer: Short, read: bool, digest: str
) -> Tried:
    names = tuple(sorted(answer.names))
    return Tried(trial, decision, variant, answer.outcome, names, read, digest)


def _keep(kept: Path, tried: Tried) -> None:
    with kept.open("a", encoding="utf-8") as file:
        file.write(json.dumps(asdict(tried)) + "\n")
