"""Commands in doubt: from which of two samples on a command acted that came midway between them.

A recording gives the time at which a command was sent, not the sample from which it acted. Of a
command that came near the middle of two samples both are possible, so the command of the first of
them has options.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_twin.arrays import Floats, Ints


@dataclass(frozen=True)
class CommandDoubt:
    """Hold the samples whose command is in doubt, and what it may be.

    Attributes:
        samples: (k,) their numbers, rising.
        values: (k, options) PWM fraction; 0 where there is no such option.
        costs: (k, options) nats by which the motion must speak for an option against the command
            of the nearest time, whose cost is 0: the more, the farther from the middle; infinite
            where there is no such option.
        chosen: (k,) option that the recording's commands hold.
    """

    samples: Ints
    values: Floats
    costs: Floats
    chosen: Ints

    def __len__(self) -> int:
        return len(self.samples)

    @property
    def added_costs(self) -> Floats:
        """Return what each option costs beyond the chosen option, nats, (k, options)."""
        return self.costs - self.costs[np.arange(len(self)), self.chosen][:, None]

    def choose_where_possible(self, options: Ints) -> CommandDoubt:
        """Return the doubt with these options (k,) chosen where they are possible."""
        possible = np.flatnonzero(np.isfinite(self.costs[np.arange(len(self)), options]))
        return self.choose(possible, options[possible])

    def sum_best_gains(self, gains: Floats) -> float:
        """Return the most nats that the motion can speak for options, beyond their costs.

        gains: (k, options) nats by which the motion speaks for each option.
        """
        return float(np.sum(np.max(gains - self.costs, axis=1)))

    def choose(self, which: Ints, options: Ints) -> CommandDoubt:
        """Return the doubt with other options chosen at the rows `which`."""
        chosen = self.chosen.copy()
        chosen[which] = options
        return replace(self, chosen=chosen)

    def pick_doubtful(self) -> CommandDoubt | None:
        """Return the samples that have more than one option; None if none has."""
        doubtful = np.isfinite(self.costs).sum(axis=1) > 1
        if not doubtful.any():
            return None
        return CommandDoubt(
            self.samples[doubtful],
            self.values[doubtful],
            self.costs[doubtful],
            self.chosen[doubtful],
        )

    def put_into(self, command: Floats) -> Floats:
        """Return the commands (n,) of a recording with the chosen options at their samples."""
        put = command.copy()
        put[self.samples] = self.values[np.arange(len(self)), self.chosen]
        return put


def join_doubts(
    doubts: Sequence[CommandDoubt | None], lengths: Sequence[int]
) -> CommandDoubt | None:
    """Return the doubts of recordings that follow one another; None where there are none.

    lengths: samples of each recording.
    """
    begins = np.cumsum([0, *lengths[:-1]])
    some = [(doubt, begin) for doubt, begin in zip(doubts, begins, strict=True) if doubt]
    if not some:
        return None
    options = max(doubt.values.shape[1] for doubt, _ in some)
    return CommandDoubt(
        np.concatenate([doubt.samples + begin for doubt, begin in some]),
        np.concatenate([_widen(doubt.values, options, 0.0) for doubt, _ in some]),
        np.concatenate([_widen(doubt.costs, options, np.inf) for doubt, _ in some]),
        np.concatenate([doubt.chosen for doubt, _ in some]),
    )


def _widen(columns: Floats, options: int, fill: float) -> Floats:
    """Return columns (k, options) with as many options as asked for."""
    missing = options - columns.shape[1]
    return np.pad(columns, ((0, 0), (0, missing)), constant_values=fill)
