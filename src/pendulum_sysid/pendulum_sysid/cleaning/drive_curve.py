"""What a drive makes of a command, up to a factor: a static curve, from the cart's balance.

A drive that saturates, or that has a dead zone, does not answer every change of the command.
Whoever asks the cart when a command acted has to know that: the curve stands between command and
cart, as in a Hammerstein model (Ljung, System Identification, 2nd ed., section 5.2). More command
never gives less force, so the curve rises.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.cart_balance import SecondDifferences
from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class DriveCurve:
    """Hold a static curve of the command, linear in pieces, that rises.

    commands: (2 k + 1,) PWM fraction, rising; where the curve may bend.
    forces: (2 k + 1,) what drives the cart there, up to a factor; 0 at 0.
    """

    commands: Floats
    forces: Floats

    def answer(self, command: Floats) -> Floats:
        """Return what drives the cart, up to a factor, at commands (n,)."""
        return np.interp(command, self.commands, self.forces)


def bend_command(command: Floats, every: Floats) -> Floats:
    """Return what adds up to any curve of a command (n,), odd about 0: (n, 1 + bends).

    The command itself comes first, then what of it lies beyond each bend.

    every: (m,) the commands among whose sizes the bends lie, not 0 throughout.
    """
    sizes, size, sign = np.abs(every), np.abs(command), np.sign(command)
    bends = np.quantile(sizes[sizes > 0.0], decisions.SLIP_BENDS)
    return np.column_stack([command, *(sign * np.maximum(size - bend, 0.0) for bend in bends)])


def fit_drive_curve(command: Floats, second: SecondDifferences) -> DriveCurve:
    """Return the curve by which the command explains the cart's acceleration best.

    Behind the curve stands the finite impulse response by which the command itself explains the
    cart: the command may come late, through a lag or a belt, and count either way round. The curve
    is a straight line where the cart moves too little to tell.

    command: (n,) PWM fraction, held; not 0 throughout.
    """
    bends = np.max(np.abs(command)) * np.linspace(0.0, 1.0, decisions.DRIVE_PIECES + 1)[1:]
    commands = np.concatenate([-bends[::-1], [0.0], bends])
    if len(second.rows) < decisions.ANSWER_LEAST_ROWS:
        return DriveCurve(commands, commands)
    answers = second.list_answers(command)
    straight = np.linalg.lstsq(
        np.column_stack([answers, second.others]), second.target, rcond=None
    )[0][: answers.shape[1]]
    pieces = np.column_stack(
        [second.list_answers(piece) @ straight for piece in _list_pieces(command, commands)]
    )
    least = np.full(pieces.shape[1] + second.others.shape[1], -np.inf)
    least[: pieces.shape[1]] = 0.0
    directions, columns = np.linalg.qr(np.column_stack([pieces, second.others]))
    slopes = lsq_linear(columns, directions.T @ second.target, (least, np.inf)).x
    slopes = slopes[: pieces.shape[1]]
    forces = np.concatenate([[0.0], np.cumsum(slopes * np.diff(commands))])
    return DriveCurve(commands, forces - forces[len(bends)])


def _list_pieces(command: Floats, commands: Floats) -> Floats:
    """Return how far commands (n,) go into each piece of the curve from 0, (2 k, n)."""
    low, high = commands[:-1, None], commands[1:, None]
    inner = np.where(low < 0.0, high, low)
    into: Floats = np.clip(command, low, high) - inner
    return into
