"""Put all questions about a balance into columns, and measure the power that any of them leave.

The weights of a question are fitted together with the twin's own constants, so that a constant
that fitting has bent gives back what it took (a partially linear model; Robinson, Econometrica 56
(1988) 931).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import LinAlgError, solve

from pendulum_sysid.finding.localisation.balance import FOLDS, Balance
from pendulum_sysid.finding.localisation.questions import Question
from pendulum_twin.arrays import Floats, Ints, Mask

ROUGH, RIDGE = 1e-4, 1e-6  # of a column's power: penalties on bends and on sizes


class Table:
    """Hold the columns of all questions about a balance, and their normal equations by fold."""

    def __init__(self, balance: Balance, questions: Sequence[Question]) -> None:
        self.balance = balance
        self.questions: dict[str, Question] = {}
        self.at: dict[str, slice] = {}
        self.used: dict[str, Mask] = {}
        end = balance.turned.shape[1]
        self.base = slice(0, end)
        blocks, penalties = [balance.turned], [np.zeros((end, end))]
        for question in questions:
            columns = balance.sieve(question.make_columns())
            power = np.mean(columns**2, axis=0)
            used = power > 1e-6 * max(float(power.max()), 1e-300)
            if used.any():
                blocks.append(columns[:, used])
                penalties.append(_make_penalty(question, columns[:, used]))
                self.questions[question.key], self.used[question.key] = question, used
                self.at[question.key] = slice(end, end + int(used.sum()))
                end += int(used.sum())
        self.columns = np.concatenate(blocks, axis=1)
        self.scale = np.sqrt(np.mean(self.columns**2, axis=0)) + 1e-300
        self.columns /= self.scale
        self.penalty = RIDGE * np.eye(end)
        for slot, penalty in zip((self.base, *self.at.values()), penalties, strict=True):
            self.penalty[slot, slot] += penalty / np.outer(self.scale[slot], self.scale[slot])
        rows = [balance.fold == k for k in range(FOLDS)]
        self.normal = np.stack([self.columns[r].T @ self.columns[r] for r in rows])
        self.gradient = np.stack([self.columns[r].T @ balance.lacking[r] for r in rows])
        self.all_normal, self.all_gradient = self.normal.sum(axis=0), self.gradient.sum(axis=0)
        self.square = np.array([balance.lacking[r] @ balance.lacking[r] for r in rows])
        self._losses: dict[frozenset[str], float] = {}

    @property
    def count(self) -> int:
        """Return how many rows there are."""
        return len(self.balance.lacking)

    def list_columns(self, keys: Sequence[str]) -> Ints:
        """Return the columns of the twin's own constants and of some questions."""
        every = np.arange(self.columns.shape[1])
        return np.concatenate([every[self.base], *(every[self.at[key]] for key in keys)])

    def compute_loss(self, keys: Sequence[str]) -> float:
        """Return the power that constants and some questions leave on held-out samples."""
        known = frozenset(keys)
        if known not in self._losses:
            at = self.list_columns(keys)
            left = float(self.square.sum())
            for k, weights in enumerate(self._fit_weights(at)):
                left += (
                    weights @ self.normal[k][np.ix_(at, at)] @ weights
                    - 2 * weights @ self.gradient[k][at]
                )
            self._losses[known] = float(left) / self.count
        return self._losses[known]

    def compute_residual(self, keys: Sequence[str]) -> Floats:
        """Return what is left on every row (rows,), predicted from the folds that it is not in."""
        at = self.list_columns(keys)
        residual = self.balance.lacking.copy()
        for k, weights in enumerate(self._fit_weights(at)):
            rows = self.balance.fold == k
            residual[rows] -= self.columns[np.ix_(rows, at)] @ weights
        return residual

    def _fit_weights(self, at: Ints) -> list[Floats]:
        """Return the weights of some columns for each fold, fitted to the others."""
        block = np.ix_(at, at)
        total = self.all_normal[block] + self.count * self.penalty[block]
        slope = self.all_gradient[at]
        return [
            _solve(total - self.normal[k][block], slope - self.gradient[k][at])
            for k in range(FOLDS)
        ]

    def compute_lead(self, rich: Sequence[str], simple: Sequence[str]) -> float:
        """Return by how many standard errors over blocks one set of questions is ahead of another.

        Under a heavy-tailed likelihood whose scale is the rich set's typical block (Lange, Little
        and Taylor, J. Am. Stat. Assoc. 84 (1989) 881): a few wild blocks neither make nor hide a
        lead.
        """
        rich_power, simple_power = (
            self._average_blocks(self.compute_residual(keys)) for keys in (rich, simple)
        )
        scale = max(float(np.median(rich_power)), (0.5 * self.balance.noise) ** 2, 1e-300)
        gain = 0.5 * (np.log1p(simple_power / scale) - np.log1p(rich_power / scale))
        return float(gain.mean()) / max(float(np.std(gain)) / np.sqrt(len(gain)), 1e-300)

    def _average_blocks(self, residual: Floats) -> Floats:
        """Return the mean square of a residual (rows,) over each block."""
        count = np.bincount(self.balance.block)
        return np.bincount(self.balance.block, residual**2)[count > 0] / count[count > 0]

    def compute_gain(self, key: str, beside: Sequence[str] = ()) -> float:
        """Return how much power a question takes away beside others."""
        return self.compute_loss(beside) - self.compute_loss((*beside, key))


def _solve(normal: Floats, slope: Floats) -> Floats:
    try:
        return solve(normal, slope, assume_a="pos", check_finite=False)
    except LinAlgError:
        return np.linalg.lstsq(normal, slope, rcond=1e-12)[0]


def _make_penalty(question: Question, columns: Floats) -> Floats:
    """Return the penalty on bends of a curve, for each row's mean power."""
    count = columns.shape[1]
    if not question.bends or count < 3:
        return np.zeros((count, count))
    bend = np.diff(np.eye(count), 2, axis=0)
    return ROUGH * float(np.mean(np.sum(columns**2, axis=1))) * bend.T @ bend
