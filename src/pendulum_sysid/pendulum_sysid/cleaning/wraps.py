"""Find and undo the wraps of an angle that its sensor keeps within one turn."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from pendulum_sysid.cleaning.detector import Fault, Samples, list_steps
from pendulum_twin.arrays import Floats

TURN = 2 * np.pi
BEGINNING = 5  # samples whose median says where it begins: the first may be a spike


def detect_wraps(samples: Samples) -> tuple[Samples, tuple[Fault, ...]]:
    """Undo the jumps of the pole's angle by whole turns."""
    if "pole" not in samples.positions:
        return samples, ()
    track, angle = samples.get_track("pole"), samples.positions["pole"].copy()
    if not len(track.values):
        return samples, ()
    angle[np.isfinite(angle)], wraps = unwrap(track.values)
    positions = {**samples.positions, "pole": angle}
    return replace(samples, positions=positions), (Fault("wrap", list_steps(track.stamps, wraps)),)


def unwrap(angle: Floats) -> tuple[Floats, NDArray[np.int64]]:
    """Return an angle (n,) rad without jumps by whole turns, and the samples before each jump.

    Every step is taken for the shortest one that leads to the same place; it counts as a wrap when
    it was within a quarter turn of whole turns. Everything is moved by whole turns so that the
    angle begins from -pi/2 to 3/2 pi: a hanging pole hangs at pi, whichever turn its sensor counts
    from, and a spring, which feels the turn, is at rest there.
    """
    steps = np.diff(angle)
    turns = np.rint(steps / TURN)
    unwrapped = angle.copy()
    if np.any(turns):
        unwrapped[1:] -= np.cumsum(turns) * TURN
    begin = float(np.median(unwrapped[:BEGINNING]))
    unwrapped -= np.floor((begin + TURN / 4) / TURN) * TURN
    return unwrapped, np.flatnonzero((turns != 0) & (np.abs(steps - turns * TURN) < TURN / 4))
