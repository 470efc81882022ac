"""Plain rivals: the first methods that an engineer would try, on the same windows of a recording.

To add a rival, write its module in this folder, with `name_effects(ground)`, and put it into the
tuple.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pendulum_sysid.studies.proof.rivals import aic_selection, all_at_once, sparse_regression
from pendulum_sysid.studies.proof.rivals.ground import Ground


def _need_nothing() -> None:
    """Accept every installation."""


@dataclass(frozen=True)
class Rival:
    """Describe a rival.

    name: in the proof.
    sentence: what it does, for a person.
    name_effects: returns the effects that it finds missing.
    check_installed: raises BadInputError when a package that it needs is missing.
    """

    name: str
    sentence: str
    name_effects: Callable[[Ground], tuple[str, ...]]
    check_installed: Callable[[], None] = _need_nothing


RIVALS: tuple[Rival, ...] = (
    Rival(
        "all_at_once",
        "one fit of all effects' terms at once; names each whose t-value passes a threshold",
        all_at_once.name_effects,
    ),
    Rival(
        "sparse_regression",
        "sparse regression of the unexplained acceleration on the catalogue's terms along the "
        "smoothed motion (PySINDy)",
        sparse_regression.name_effects,
        sparse_regression.check_installed,
    ),
    Rival(
        "aic_selection",
        "forward selection of effects by Akaike's criterion on free runs",
        aic_selection.name_effects,
    ),
)


def find_rival(name: str) -> Rival:
    """Return the rival with this name."""
    return next(rival for rival in RIVALS if rival.name == name)
