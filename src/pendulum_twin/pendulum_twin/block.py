"""Lay out a block of lanes: one array, row by row, lane beside lane: theta, then these rows.

There is one array because the compiler computes lanes side by side only where it can prove that it
does not write what it reads. Whole numbers stand in an array of their own, `places`, and so do
strains (`hysteresis`). Functions of a step take arrays, not a record of arrays: the compiler
counts the references to each array of a record whenever a record is opened, which took a sixth to
a quarter of the time of a step with measured laws.
"""

from __future__ import annotations

from pendulum_twin import compose
from pendulum_twin.equations import compile_inner
from pendulum_twin.hysteresis import STRAINS
from pendulum_twin.parameter_vector import LAWS

# A block holds theta without its measured laws, whose curves each lane reads from its own theta.
ROWS = LAWS + 64 + compose.KEPT + len(compose.SWITCHED)
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
# each lane's rig without effects: mass, kg; viscous friction of the cart, N s/m
OWN_MASS, OWN_VISCOUS = LAWS + 20, LAWS + 21
CURVED = LAWS + 22  # 1 where a lane has measured curves
# what costly laws add at a state, and where both joints stand there (`applied` in `motion.py`)
COSTLY, AT_REST = LAWS + 23, LAWS + 27
# states of the second, third and fourth stage of a step; accelerations of the first three
STAGES, RATES = LAWS + 31, LAWS + 43
# the state in the middle of a step, as its first velocities lead there, and the time there, s
MIDDLE, TIME = LAWS + 51, LAWS + 55
LOAD = LAWS + 56  # kg, what effects add to the mass over the step
EVEN = LAWS + 57  # four numbers that effects hold over the step; see `compose.compose_held`
FREED = LAWS + 61  # N s/m, what the drive adds to the cart's viscous friction over the step
MOVE = LAWS + 62  # m, a move of the cart
PUSH = LAWS + 63  # N, mean over a step of what acts on the cart beside the drive
PATH = LAWS + 64  # forces on the cart that follow its path, N
REACTION = PATH + compose.PATHS  # what the reactions of the drive keep
# in the first lane's place, for each effect that is switched: 1 where it is on in any lane
SWITCHES = PATH + compose.KEPT


# Rows of `places`, (4, width): which lane of all each is (a block that is not full ends with its
# last lane, again and again), its row of theta, the step of its row of drives at which it starts,
# and substeps since the recording began, at its start.
LANE, ROW, AT, DONE = range(4)


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
