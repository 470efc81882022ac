"""Lay out a block of lanes: one array, row by row, lane beside lane: theta, then these rows.

There is one array because the compiler computes lanes side by side only where it can prove that it
does not write what it reads. `Block` holds what the lanes need beside it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pendulum_twin import compose
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.equations import compile_inner
from pendulum_twin.hysteresis import STRAINS
from pendulum_twin.parameter_vector import LAWS

# A block holds theta without its measured laws, whose curves each lane reads from its own theta.
ROWS = LAWS + 20 + compose.KEPT
# What a lane remembers of its path: forces of effects on the cart, N, what the
# reactions of the drive keep, then strains (`hysteresis`).
PATH_SIZE = compose.KEPT + STRAINS
X, TH, V, W = range(LAWS, LAWS + 4)
# the state at the begin of the step
X_BEFORE, TH_BEFORE, V_BEFORE, W_BEFORE = range(LAWS + 4, LAWS + 8)
CART_WAY, POLE_WAY, CART_FREE, POLE_FREE = range(LAWS + 8, LAWS + 12)  # the modes; see `motion.py`
# what acts evenly over the step (`applied` in `motion.py`); the first is the force on the cart, N
FORCE, TORQUE, CART_DRY, POLE_DRY = range(LAWS + 12, LAWS + 16)
ENDED = LAWS + 16  # 1 where a mode has ended within the step
H = LAWS + 17  # the step, s
EVEN_H = LAWS + 18  # s, the step without the clock's measured law; laws count time by this step
PUSHED = LAWS + 19  # N, the part of the force that effects and laws add to the drive's
PATH = LAWS + 20  # forces on the cart that follow its path, N
REACTION = PATH + compose.PATHS  # what the reactions of the drive keep


@compile_inner
def get_four(p, row, i, width):
    """Return four neighbouring rows of lane i: a state or modes."""
    return (
        p[row * width + i],
        p[(row + 1) * width + i],
        p[(row + 2) * width + i],
        p[(row + 3) * width + i],
    )


@compile_inner
def put_four(p, row, i, width, four):
    """Set four neighbouring rows of lane i."""
    for k in range(4):
        p[(row + k) * width + i] = four[k]


class Block(NamedTuple):
    """Hold what is kept of the lanes of a block beside their states.

    lane: (width,) which lane of all each is; a block that is not full ends with its last lane,
        again and again.
    row: (width,) row of theta of each lane.
    at: (width,) step of its row of drives at which each lane starts.
    done: (width,) substeps since the recording began, at each lane's start.
    constants: (2, width) of each lane's rig without effects: mass, kg; viscous friction, N s/m.
    curved: (width + 1,) whether each lane has measured curves, then whether any has.
    elements, listed, moves, loads: see `hysteresis`; no elements where no twin has hysteresis.
    """

    lane: Ints
    row: Ints
    at: Ints
    done: Ints
    constants: Floats
    curved: Mask
    elements: Floats
    listed: Ints
    moves: Floats
    loads: Floats


@compile_inner
def make_block(width, remembers):
    """Return a block of lanes, still empty; remembers: whether a twin has measured hysteresis."""
    strains = STRAINS if remembers else 0
    return Block(
        np.empty(width, dtype=np.int64),
        np.empty(width, dtype=np.int64),
        np.empty(width, dtype=np.int64),
        np.empty(width, dtype=np.int64),
        np.empty((2, width)),
        np.empty(width + 1, dtype=np.bool_),
        np.empty((3, strains, width)),
        np.empty(strains, dtype=np.int64),
        np.empty((2, width)),
        np.empty((2, width)),
    )
