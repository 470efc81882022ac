"""Plain rivals: other ways to name what is missing, each as one would first do it, on the same windows of a recording.

To add one: write its module beside these, with `answer(ground)`, and put it into the tuple.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from pendulum_sysid.studies.proof.rivals import aic_selection, all_at_once, sparse_regression
from pendulum_sysid.studies.proof.rivals.ground import Ground


@dataclass(frozen=True)
class Rival:
    """Describe a rival: its name in the proof, a sentence for a person, its answer, and a check of what it needs."""

    name: str
    sentence: str
    answer: Callable[[Ground], tuple[str, ...]]
    check: Callable[[], None] = lambda: None


RIVALS: tuple[Rival, ...] = (
    Rival(
        "all_at_once",
        "one fit of all effects' terms at once; those are named whose t-value passes a threshold",
        all_at_once.name_effects,
    ),
    Rival(
        "sparse_regression",
        "sparse regression of the unexplained acceleration on the catalogue's terms along the smoothed motion (PySINDy)",
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
    return next(one for one in RIVALS if one.name == name)
