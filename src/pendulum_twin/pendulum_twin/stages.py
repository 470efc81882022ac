"""Move a block of lanes over a step stage by stage: costly laws are asked effect by effect.

The arithmetic is that of `motion.advance_step`. The states of the stages stand in rows of the
block.
"""

from __future__ import annotations

from pendulum_twin import compose_rows
from pendulum_twin.block import CART_WAY, COSTLY, FORCE, RATES, STAGES, H, X, get_four, put_four
from pendulum_twin.equations import compile_inner
from pendulum_twin.motion import compute_accelerations, end_step

ask_costly_laws = compose_rows.compose_costly_rows()


@compile_inner
def get_applied(costly, p, i, width, laws):
    """Return what is applied to lane i; costly: first row of what costly laws add."""
    evenly = get_four(p, FORCE, i, width)
    if len(laws) > 1:
        return evenly + get_four(p, costly, i, width)
    return evenly


@compile_inner
def advance_by_stages(laws, p, width):
    """Advance every lane by one step; what costly laws add at its begin stands in the block."""
    _leave_stage(X, RATES, STAGES, 0.5, laws, p, width)
    _leave_stage(STAGES, RATES + 2, STAGES + 4, 0.5, laws, p, width)
    _leave_stage(STAGES + 4, RATES + 4, STAGES + 8, 1.0, laws, p, width)
    for i in range(width):
        _, _, v2, w2 = get_four(p, STAGES, i, width)
        _, _, v3, w3 = get_four(p, STAGES + 4, i, width)
        _, _, v4, w4 = get_four(p, STAGES + 8, i, width)
        a1, b1, a2, b2 = get_four(p, RATES, i, width)
        a3, b3 = p[(RATES + 4) * width + i], p[(RATES + 5) * width + i]
        rates = (a1, b1), (a2, b2), (a3, b3), _accelerate(STAGES + 8, laws, p, i, width)
        speeds = (v2, w2), (v3, w3), (v4, w4)
        state = get_four(p, X, i, width)
        put_four(p, X, i, width, end_step(state, speeds, rates, p[H * width + i]))


@compile_inner
def _leave_stage(stage, rates, following, share, laws, p, width):
    """Set every lane's accelerations at a stage, and the state of the following stage.

    stage, rates, following: first row of the state, of its accelerations, of the state to set.
    share: of the step, which the following stage is off its begin.
    """
    for i in range(width):
        _, _, v_there, w_there = get_four(p, stage, i, width)
        a, b = _accelerate(stage, laws, p, i, width)
        p[rates * width + i], p[(rates + 1) * width + i] = a, b
        x, th, v, w = get_four(p, X, i, width)
        h = share * p[H * width + i]
        put_four(p, following, i, width, (x + h * v_there, th + h * w_there, v + h * a, w + h * b))
    ask_costly_laws(following, COSTLY, 1.0, p, width)


@compile_inner
def _accelerate(stage, laws, p, i, width):
    """Return lane i's accelerations at a stage; stage: first row of its state."""
    state, modes = get_four(p, stage, i, width), get_four(p, CART_WAY, i, width)
    applied = get_applied(COSTLY, p, i, width, laws)
    return compute_accelerations(state, applied, modes, p, i, width, laws)
