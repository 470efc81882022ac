"""Suggest the names that may have been meant, for a name that does not exist."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

LEAST_LIKENESS = 0.6  # of two names, 0 to 1 (difflib): half of a name may be mistyped
MOST_SUGGESTIONS = 4  # more names that begin alike are no help
SHORTEST_BEGINNING = 2  # letters


def suggest_names(word: object, names: Iterable[str]) -> tuple[str, ...]:
    """Return the names that a word begins, else the name that is most like it, whatever its case.

    Nothing where no name is alike, or where the word begins many.
    """
    plain = {_simplify(name): name for name in names}
    simple = _simplify(str(word))
    begun = [plain[key] for key in plain if key.startswith(simple)]
    if len(simple) >= SHORTEST_BEGINNING and 0 < len(begun) <= MOST_SUGGESTIONS:
        return tuple(begun)
    near = difflib.get_close_matches(simple, plain, 1, LEAST_LIKENESS)
    return tuple(plain[key] for key in near)


def ask_if_meant(word: object, names: Iterable[str]) -> str:
    """Return "did you mean NAME?", or nothing where no name is alike."""
    *others, last = suggest_names(word, names) or ("",)
    meant = f"{', '.join(others)} or {last}" if others else last
    return f"did you mean {meant}?" if meant else ""


def add_hint(word: object, names: Iterable[str]) -> str:
    """Return "; did you mean NAME?" for the end of a sentence, or nothing."""
    meant = ask_if_meant(word, names)
    return f"; {meant}" if meant else ""


def hint_at_names(word: object, names: Iterable[str]) -> str:
    """Return "did you mean NAME?", or all names where none is alike."""
    names = tuple(names)
    return ask_if_meant(word, names) or f"known are {', '.join(names)}"


def _simplify(name: str) -> str:
    return name.lower().replace("-", "_")
