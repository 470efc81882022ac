"""Place runs in the lanes of a block, and keep what they remember at their end."""

from __future__ import annotations

import numpy as np

from pendulum_twin import compose
from pendulum_twin.block import (
    AT,
    AT_REST,
    CART_WAY,
    COSTLY,
    CURVED,
    DONE,
    EVEN_H,
    FORCE,
    LANE,
    OWN_MASS,
    OWN_VISCOUS,
    PATH,
    ROW,
    SWITCHES,
    H,
    X,
    put_four,
)
from pendulum_twin.equations import compile_inner
from pendulum_twin.hysteresis import keep_strains, list_elements, place_elements
from pendulum_twin.law_curves import has_curves, has_pace
from pendulum_twin.motion import MOVING
from pendulum_twin.parameter_vector import BEGINS, CART_VISCOUS, LAWS, MASS, NEUTRAL

compute_pace = compose.compose_pace()
SWITCHED = np.array(compose.SWITCHED)


@compile_inner
def _place_lane(theta, start_state, path_memory, h, p, i, width):
    """Place the start of a run in lane i: both joints move, and no force acts yet.

    h: s by the stamps, a substep.
    """
    for k in range(LAWS):
        p[k * width + i] = theta[k]
    for k in range(4):
        p[(X + k) * width + i] = start_state[k]
    for k in range(compose.KEPT):
        p[(PATH + k) * width + i] = path_memory[k]
    p[OWN_MASS * width + i], p[OWN_VISCOUS * width + i] = theta[MASS], theta[CART_VISCOUS]
    put_four(p, CART_WAY, i, width, MOVING)
    put_four(p, COSTLY, i, width, (0.0, 0.0, 0.0, 0.0))
    put_four(p, AT_REST, i, width, (0.0, 0.0, 0.0, 0.0))
    put_four(p, FORCE, i, width, (0.0, 0.0, 0.0, 0.0))
    p[EVEN_H * width + i] = h * compute_pace(p, i, width)
    p[H * width + i] = p[EVEN_H * width + i]


@compile_inner
def place_block(
    first,
    measured,
    begin,
    first_step,
    starts,
    path_memory,
    theta,
    set_of,
    h,
    places,
    elements,
    listed,
    p,
):
    """Place the lanes from the first on in the block.

    first: lane; places, p: see `block`; elements, listed: see `hysteresis`. The other arguments
    are those of `kernel.integrate_lanes`.

    Returns whether any lane has measured curves, whether a law changes a clock's pace, and the
    counts of elements that `hysteresis` explains.
    """
    width = places.shape[1]
    curved, paced = False, False
    for i in range(width):
        lane = min(first + i, len(set_of) - 1)
        own = theta[set_of[lane]]
        places[LANE, i], places[ROW, i] = lane, set_of[lane]
        places[AT, i], places[DONE, i] = begin[lane], first_step[lane]
        _place_lane(own, starts[lane], path_memory[lane], h, p, i, width)
        has_own = measured is not None and has_curves(own)
        p[CURVED * width + i] = 1.0 if has_own else 0.0
        curved = curved or has_own
        paced = paced or (measured is not None and has_pace(own))
        if measured is not None and len(measured) > 1:
            place_elements(own, path_memory[lane, compose.KEPT :], elements, i)
    remembers = measured is not None and len(measured) > 1
    return curved, paced, list_elements(elements, listed) if remembers else (0, 0)


@compile_inner
def switch_effects(places, theta, p, width):
    """Set for each effect of `compose.SWITCHED` whether it is on in any lane of the block."""
    for n in range(len(SWITCHED)):
        on = 0.0
        for i in range(width):
            own = theta[places[ROW, i]]
            for word in range(BEGINS[SWITCHED[n]], BEGINS[SWITCHED[n] + 1]):
                on = 1.0 if own[word] != NEUTRAL[word] else on
        p[(SWITCHES + n) * width] = on


@compile_inner
def keep_paths(first, count, measured, elements, path_memory, p, width):
    """Fill path_memory with what the block's lanes remember; the arguments of `place_block`."""
    for i in range(min(width, count - first)):
        for k in range(compose.KEPT):
            path_memory[first + i, k] = p[(PATH + k) * width + i]
        if measured is not None and len(measured) > 1:
            keep_strains(elements, i, path_memory[first + i, compose.KEPT :])
