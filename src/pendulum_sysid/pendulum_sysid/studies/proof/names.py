"""Judge names: what was concealed against what an answer says. Pure, and the same for the diagnosis and its rivals."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from pendulum_sysid.records import Outcome
from pendulum_sysid.studies.proof.records import (
    Answer,
    Cell,
    NamesJudgement,
    NamesOutcome,
    OpenedTrial,
)
from pendulum_twin.effects import BY_NAME

NOT_NAMED, NOT_IN_CATALOGUE = "not named", "not_in_catalogue"
NOTHING, BESIDE = "(nothing)", "(beside what is there)"
STALE = "stale_start"


def judge_names(sealed: OpenedTrial, answer: Answer) -> NamesJudgement:
    """Return how an answer's names agree with the seal.

    Names are right when they are exactly those concealed. A concealed effect also counts as named
    when an entry that is not there itself says that it cannot be told from it (each entry excuses
    one): that is told apart as tied. A stale start counts as found where stale samples were found.
    """
    concealed = dict.fromkeys(sealed.effects)
    found_stale = STALE in concealed and answer.stale and STALE not in answer.named
    named = {**answer.named, **({STALE: ()} if found_stale else {})}
    lost = [name for name in concealed if name not in named]
    extra = [name for name in named if name not in concealed]
    excused = match_inseparable(lost, {name: named[name] for name in extra})
    lost = [name for name in lost if name not in excused]
    extra = [name for name in extra if name not in excused.values()]
    cells = (
        *(Cell(name, name) for name in concealed if name in named),
        *(Cell(name, entry, tied=True) for name, entry in excused.items()),
        *_confused(sealed, answer, lost, extra),
    )
    how = _how(sealed, answer, lost, extra, bool(excused))
    if not sealed.unlisted:
        return NamesJudgement(how, cells)
    located = any(one.place == answer.place for one in sealed.unlisted)
    asked = {part for variable in answer.variables for part in variable.split("*")}
    asked |= {"time"} if "frequency" in asked else set()
    depends = any(set(one.variables) & asked for one in sealed.unlisted)
    return NamesJudgement(how, cells, located, depends)


def match_inseparable(
    lost: Collection[str], extra: Mapping[str, Collection[str]]
) -> dict[str, str]:
    """Return effect not named -> entry in its place that cannot be told from it; as many as can be, each entry once."""
    entry_of: dict[str, str] = {}

    def place(name: str, tried: set[str]) -> bool:
        """Find an entry for one effect, moving others where that makes room (augmenting paths)."""
        for entry, ties in extra.items():
            if name in ties and entry not in tried:
                tried.add(entry)
                holder = next((n for n, e in entry_of.items() if e == entry), None)
                if holder is None or place(holder, tried):
                    entry_of[name] = entry
                    return True
        return False

    for name in lost:
        place(name, set())
    return entry_of


def _how(
    sealed: OpenedTrial, answer: Answer, lost: list[str], extra: list[str], tied: bool
) -> NamesOutcome:
    if answer.error:
        return NamesOutcome.CRASHED
    if answer.outcome == Outcome.UNUSABLE.value:
        return NamesOutcome.ABSTAINED
    alarmed = answer.outcome != Outcome.NOTHING_MISSING.value
    unexplained = answer.outcome == Outcome.NOT_IN_CATALOGUE.value
    if not sealed.effects and not sealed.unlisted:
        return NamesOutcome.FALSE_ALARM if extra or alarmed else NamesOutcome.RIGHT
    if any(not (unexplained and sealed.unlisted and _sign(name)) for name in extra):
        return NamesOutcome.WRONG
    if sealed.unlisted:
        return (
            NamesOutcome.RIGHT
            if unexplained and not lost
            else NamesOutcome.ABSTAINED
            if alarmed
            else NamesOutcome.MISSED
        )
    if unexplained:
        return NamesOutcome.ABSTAINED
    if lost:
        return NamesOutcome.MISSED if not answer.named else NamesOutcome.INCOMPLETE
    return NamesOutcome.TIED if tied else NamesOutcome.RIGHT


def _sign(name: str) -> bool:
    """Return whether an effect is one of those that are only there or not: a wrong sign."""
    return name in BY_NAME and not BY_NAME[name].parameters


def _confused(
    sealed: OpenedTrial, answer: Answer, lost: list[str], extra: list[str]
) -> list[Cell]:
    """Return who was taken for whom: what is not named for a wrong name of its place, else for any, else for none."""
    left = list(extra)
    nobody = NOT_IN_CATALOGUE if answer.outcome == Outcome.NOT_IN_CATALOGUE.value else NOT_NAMED
    taken: dict[str, str] = {}
    for same_place in (True, False):
        for name in [n for n in lost if n not in taken]:
            fits = [e for e in left if not same_place or _place(e) == _place(name)]
            if fits:
                taken[name] = fits[0]
                left.remove(fits[0])
    cells = [Cell(name, taken.get(name, nobody)) for name in lost]
    for one in sealed.unlisted:
        cells.append(Cell(f"unlisted: {one.name}", left.pop(0) if left else nobody))
    if not sealed.effects and not sealed.unlisted:
        cells += [Cell(NOTHING, name) for name in left] or [Cell(NOTHING, nobody)]
    else:
        cells += [Cell(BESIDE, name) for name in left]
    return cells


def _place(name: str) -> str:
    return BY_NAME[name].place.value if name in BY_NAME else ""
