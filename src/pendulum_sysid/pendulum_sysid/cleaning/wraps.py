"""An angle that its sensor wraps into one turn, and the same angle as it really went."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pendulum_twin.signals import Floats

TURN = 2 * np.pi
LOWEST, HIGHEST = -np.pi, TURN  # an angle that begins between these stays where it is
BEGINNING = 5  # samples whose median says where it begins: the first may be a spike


def unwrap(angle: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return an angle (n,) in rad without its jumps by whole turns, and the samples after which it jumped.

    Every step is taken for the shortest one that leads to the same place; it counts as a wrap when
    it was within a quarter turn of whole turns. The first sample keeps its value when the angle
    begins from -pi to 2 pi; otherwise everything is moved by whole turns so that it begins from
    -pi/2 to 3/2 pi.
    """
    steps = np.diff(angle)
    turns = np.rint(steps / TURN)
    out = angle.copy()
    if np.any(turns):
        out[1:] -= np.cumsum(turns) * TURN
    begin = float(np.median(out[:BEGINNING]))
    if not LOWEST <= begin <= HIGHEST:
        out -= np.floor((begin + TURN / 4) / TURN) * TURN
    return out, np.flatnonzero((turns != 0) & (np.abs(steps - turns * TURN) < TURN / 4))
