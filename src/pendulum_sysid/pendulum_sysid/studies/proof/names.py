"""Compare the names in an answer with a seal: one judge for diagnosis, rivals and demo.

Pure: no file is read, nothing is kept. The catalogue, which takes a second to import, is imported
with the first comparison and not with this module.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import maximum_bipartite_matching

from pendulum_sysid.studies.proof.records import (
    Cell,
    NameCounts,
    NamesJudgement,
    NamesOutcome,
    Seal,
    TrialAnswer,
)

# Stand-ins of the confusion matrix, for what is not an effect of the catalogue.
NOT_NAMED = "not named"
NOTHING = "(nothing)"
BESIDE = "(beside what is there)"

# Outcomes as they stand in verdict.json.
NOTHING_MISSING = "nothing_missing"
NOT_IN_CATALOGUE = "not_in_catalogue"
UNUSABLE = "unusable"

STALE_START = "stale_start"


def judge_names(seal: Seal, answer: TrialAnswer) -> NamesJudgement:
    """Return how the names in an answer compare with the seal.

    1. Names are right when they are exactly those of the concealed effects.
    2. A concealed effect also counts as named, by a tie, when an effect that was not concealed is
       named and the answer says that the two cannot be told apart. Each such name excuses one
       concealed effect.
    3. A concealed stale start counts as named where the answer reports stale samples.
    4. Physics that the catalogue does not have must not be forced onto a name. Wrong signs may
       stand beside it: they are present or absent, and absorb nothing.
    5. Where a rest is always on, an answer may say that physics without a name remains.
    """
    named, lost, extra, tie_of = _compare_names(seal, answer)
    return NamesJudgement(
        outcome=_classify(seal, answer, lost, extra, bool(tie_of)),
        cells=(
            *(Cell(name, name) for name in seal.effects if name in named),
            *(Cell(name, entry, tied=True) for name, entry in tie_of.items()),
            *_pair_mistakes(seal, answer, lost, extra),
        ),
        located=_is_located(seal, answer) if seal.unlisted else None,
        depends=_has_variable(seal, answer) if seal.unlisted else None,
    )


def count_names(seal: Seal, answer: TrialAnswer) -> NameCounts:
    """Return how many names in an answer are false, and how many concealed effects have none.

    The rules are those of `judge_names`. A name is false, and a concealed effect is without a
    name, whatever else the answer says.
    """
    named, lost, extra, _ = _compare_names(seal, answer)
    beside_unlisted = _may_add_signs(seal, answer)
    wrong = [name for name in extra if not (beside_unlisted and _is_sign(name))]
    return NameCounts(len(named), len(wrong), len(seal.effects), len(lost))


def _compare_names(
    seal: Seal, answer: TrialAnswer
) -> tuple[dict[str, tuple[str, ...]], list[str], list[str], dict[str, str]]:
    """Return the names, those that are missing, those too many, and what ties excuse."""
    named = _add_stale_start(seal, answer)
    lost = [name for name in seal.effects if name not in named]
    extra = [name for name in named if name not in seal.effects]
    tie_of = match_inseparable(lost, {name: named[name] for name in extra})
    lost = [name for name in lost if name not in tie_of]
    extra = [name for name in extra if name not in tie_of.values()]
    return named, lost, extra, tie_of


def _may_add_signs(seal: Seal, answer: TrialAnswer) -> bool:
    return answer.outcome == NOT_IN_CATALOGUE and bool(seal.unlisted)


def match_inseparable(
    lost: Sequence[str], inseparable_from: Mapping[str, Sequence[str]]
) -> dict[str, str]:
    """Return concealed effect -> effect named in its place that cannot be told from it.

    As many pairs as possible, each name in one pair (maximum bipartite matching).

    lost: concealed effects that are not named.
    inseparable_from: effect that was named and not concealed -> effects it cannot be told from.
    """
    if not lost or not inseparable_from:
        return {}
    entries = list(inseparable_from)
    ties = np.array([[name in inseparable_from[entry] for entry in entries] for name in lost])
    columns = maximum_bipartite_matching(csr_array(ties.astype(np.int8)), perm_type="column")
    return {
        name: entries[column] for name, column in zip(lost, columns, strict=True) if column >= 0
    }


def describe_cell(cell: Cell) -> str:
    """Return how one effect was answered, as a few words to stand after its name."""
    if cell.concealed == cell.named:
        return "named"
    if cell.concealed in (BESIDE, NOTHING):
        return "not concealed"
    if cell.tied:
        return f"not named, but {cell.named}, which this recording cannot tell from it"
    return "not named"


def _add_stale_start(seal: Seal, answer: TrialAnswer) -> dict[str, tuple[str, ...]]:
    """Return the named effects, with the stale start that is reported as stale samples."""
    reported = STALE_START in seal.effects and answer.stale and STALE_START not in answer.named
    return {**answer.named, **({STALE_START: ()} if reported else {})}


def _classify(
    seal: Seal, answer: TrialAnswer, lost: Sequence[str], extra: Sequence[str], tied: bool
) -> NamesOutcome:
    """Return the outcome. lost, extra: names missing and names too many, ties taken out."""
    if answer.error:
        return NamesOutcome.CRASHED
    if answer.outcome == UNUSABLE:
        return NamesOutcome.ABSTAINED
    alarmed = answer.outcome != NOTHING_MISSING
    unexplained = answer.outcome == NOT_IN_CATALOGUE
    if not seal.effects and not seal.unlisted:
        alarmed = alarmed and not (unexplained and seal.rest)
        return NamesOutcome.FALSE_ALARM if extra or alarmed else NamesOutcome.RIGHT
    may_add_signs = _may_add_signs(seal, answer)
    if any(not (may_add_signs and _is_sign(name)) for name in extra):
        return NamesOutcome.WRONG
    if seal.unlisted:
        if unexplained and not lost:
            return NamesOutcome.RIGHT
        return NamesOutcome.ABSTAINED if alarmed else NamesOutcome.MISSED
    if unexplained and not seal.rest:
        return NamesOutcome.ABSTAINED
    if lost:
        return NamesOutcome.INCOMPLETE if answer.named else NamesOutcome.MISSED
    return NamesOutcome.TIED if tied else NamesOutcome.RIGHT


def _is_located(seal: Seal, answer: TrialAnswer) -> bool:
    """Return whether the answer's place is a place of the unlisted physics."""
    return any(effect.place == answer.place for effect in seal.unlisted)


def _has_variable(seal: Seal, answer: TrialAnswer) -> bool:
    """Return whether the evidence holds a variable that the unlisted physics depends on."""
    variables = {factor for product in answer.variables for factor in product.split("*")}
    if "frequency" in variables:
        variables.add("time")
    return any(variables.intersection(effect.variables) for effect in seal.unlisted)


def _pair_mistakes(
    seal: Seal, answer: TrialAnswer, lost: Sequence[str], extra: Sequence[str]
) -> list[Cell]:
    """Return the cells of the mistakes.

    A lost effect is paired with a wrong name at its own place, else with any wrong name, else
    with none. Wrong names that remain stand beside what is there.
    """
    spare = list(extra)
    nobody = NOT_IN_CATALOGUE if answer.outcome == NOT_IN_CATALOGUE else NOT_NAMED
    taken: dict[str, str] = {}
    for same_place in (True, False):
        for name in lost:
            fits = [e for e in spare if not same_place or _find_place(e) == _find_place(name)]
            if name not in taken and fits:
                taken[name] = fits[0]
                spare.remove(fits[0])
    cells = [Cell(name, taken.get(name, nobody)) for name in lost]
    for effect in seal.unlisted:
        cells.append(Cell(f"unlisted: {effect.name}", spare.pop(0) if spare else nobody))
    if seal.effects or seal.unlisted:
        return cells + [Cell(BESIDE, name) for name in spare]
    return [Cell(NOTHING, name) for name in spare] or [Cell(NOTHING, nobody)]


def _is_sign(name: str) -> bool:
    """Return whether an effect is a wrong sign: present or absent, without a parameter."""
    from pendulum_twin.effects import BY_NAME

    return name in BY_NAME and not BY_NAME[name].parameters


def _find_place(name: str) -> str:
    """Return the place of the chain where an effect acts; empty for a name without an effect."""
    from pendulum_twin.effects import BY_NAME

    return BY_NAME[name].place.value if name in BY_NAME else ""
