"""What every step of a search has in hand: the case, its windows, a journal of the fits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import begin_fit, fit, fit_over_horizon
from pendulum_sysid.fitting.windows import WINDOW_S
from pendulum_sysid.records import Fit, Split, Trial
from pendulum_twin.arrays import Floats

Progress = Callable[[str], None]


def report_nothing(line: str) -> None:
    """Take a line of progress and say nothing."""


class Journal:
    """Record the fits of a search in their order, for the report's table, and report its progress.

    report: takes one line for a person.
    """

    def __init__(self, report: Progress = report_nothing) -> None:
        self.report = report
        self._trials: list[Trial] = []
        self.fits: list[Fit] = []

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Return a row for every fit that was noted."""
        return tuple(self._trials)

    def note(self, fit: Fit, verdict: str) -> None:
        """Add a fit and what was decided about it."""
        self.fits.append(fit)
        self._trials.append(Trial(fit.effects, fit.train, fit.choose, verdict))


@dataclass(frozen=True)
class Search:
    """Hold what stays the same during a search.

    case: the recording and the twin to start from.
    split: windows to fit and to choose on, by cross-validation, and windows to judge on.
    journal: the fits tried so far.
    is_pole_alone: whether the case is the pole by itself, its axis moved as recorded.
    refuted: effects that measured laws have parted from the effects that contain them; they stand
        in no effect's place.
    """

    case: Case
    split: Split
    journal: Journal = field(default_factory=Journal)
    is_pole_alone: bool = False
    refuted: tuple[str, ...] = ()

    def fit_effects(self, effects: tuple[str, ...], start: Fit, theta: Floats) -> Fit:
        """Return the best fit of these effects, over the horizon of another fit.

        start: the fit whose start states of windows are taken over.
        theta: (SIZE,) or (starts, SIZE) parameter vectors to start from.
        """
        thetas, start_states = np.atleast_2d(theta), start.start_states
        vector = thetas[0]
        if len(thetas) > 1:
            vector, start_states = begin_fit(
                self.case, self.split, effects, thetas, start.pieces, start_states
            )
        return fit(self.case, self.split, effects, vector, start.pieces, start_states)

    def fit_over_horizon(self, known: Fit, pieces: int) -> Fit:
        """Return the same set of effects fitted with every window cut into so many pieces."""
        other = fit_over_horizon(self.case, self.split, known, pieces)
        self.journal.note(other, f"over {WINDOW_S / pieces:g} s")
        return other
