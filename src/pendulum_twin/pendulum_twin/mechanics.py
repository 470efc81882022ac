"""Move lanes by the laws of cart and pole: the least compiled code that holds their effects."""

from __future__ import annotations

import numpy as np

from pendulum_twin import compose, kernel
from pendulum_twin.arrays import Floats, Ints
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.laws.kind import REMEMBERING, SENSOR_ERRORS, Role
from pendulum_twin.motion import (
    ALL_LAWS,
    CURVES,
    HYSTERESIS,
    NO_LAWS,
    PLAIN_LAWS,
)
from pendulum_twin.parameter_vector import find_active_effects, list_law_kinds
from pendulum_twin.threads import share_among_threads

# Masks over the catalogue: effects of the mechanics, those that a block asks only where they are
# on, laws that can hold a joint.
_MECHANICAL = np.array(
    [
        e.form in (Form.FORCE, Form.DRY, Form.DRY_RATIO, Form.HOLD, *compose.HELD_FORMS)
        for e in CATALOGUE
    ]
)
_SWITCHED = np.isin(np.arange(len(CATALOGUE)), compose.SWITCHED)
_STICKING = np.array(
    [e.form in (Form.DRY, Form.HOLD, Form.TIMED_FRICTION, Form.STATE_FRICTION) for e in CATALOGUE]
)
_DRY = (Role.CART_DRY, Role.POLE_DRY)
_ELSEWHERE = (Role.COMMAND, *SENSOR_ERRORS)  # act in the passes of the drive and the sensors
_HELD = tuple(r for r in Role if r not in (*_DRY, *REMEMBERING, *_ELSEWHERE))


def run_mechanics(
    drives: Floats,
    drive_of: Ints,
    begin: Ints,
    first_step: Ints,
    start_states: Floats,
    theta: Floats,
    h: float,
    sub: int,
    out: Floats,
    set_of: Ints | None = None,
    path_memory: Floats | None = None,
) -> None:
    """Call `kernel.integrate_lanes` with the least code that holds the effects of the lanes.

    Lanes are independent: several threads share the blocks of lanes where the work is worth it.

    theta: (sets, SIZE) the twins.
    set_of: (lanes,) the twin of each lane; None where each lane has a twin of its own.
    path_memory: (lanes, PATH_SIZE) what lanes remember of their paths at the start; afterwards at
        the end. None: the path begins at the start.
    """
    code, lanes = select_kernel_code(theta), len(begin)
    rows = np.arange(lanes) if set_of is None else set_of
    if path_memory is None:
        path_memory = np.zeros((lanes, PATH_SIZE))
    drives, start_states, theta = map(np.ascontiguousarray, (drives, start_states, theta))

    def integrate(part: slice) -> None:
        kernel.integrate_lanes(
            (0,) * (1 if lanes == 1 else kernel.WIDTH),
            *code,
            drives,
            drive_of[part],
            begin[part],
            first_step[part],
            start_states[part],
            path_memory[part],
            theta,
            rows[part],
            h,
            sub,
            out[part],
        )

    share_among_threads(integrate, lanes, out.shape[1] * sub)


def select_kernel_code(
    theta: Floats,
) -> tuple[tuple[int, ...] | None, bool, tuple[int, ...] | None]:
    """Return laws, dry and measured of `kernel.integrate_lanes`: the least code.

    theta: (sets, SIZE).
    """
    on = find_active_effects(theta)
    roles = {kind.role for kind in list_law_kinds(theta)}
    sticks = not roles.isdisjoint(_DRY)
    dry = bool(np.any(on & _STICKING)) or sticks
    measured: tuple[int, ...] | None = CURVES if sticks or not roles.isdisjoint(_HELD) else None
    if not roles.isdisjoint(REMEMBERING):
        measured = HYSTERESIS
    if np.any(on & _SWITCHED):
        return ALL_LAWS, dry, measured
    return PLAIN_LAWS if sticks or np.any(on & _MECHANICAL) else NO_LAWS, dry, measured
