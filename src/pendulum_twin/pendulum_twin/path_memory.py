"""Follow what remembers the path of the joints along a recorded motion."""

from __future__ import annotations

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.compose import KEPT, PATHS
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.hysteresis import (
    STRAINS,
    follow_strains,
    keep_strains,
    list_elements,
    sum_hysteresis,
)
from pendulum_twin.motion import follow_path
from pendulum_twin.parameter_vector import find_active_effects, list_law_kinds
from pendulum_twin.signals import Signals

_FOLLOWING: Mask = np.array([e.form is Form.PATH_FORCE for e in CATALOGUE])


def remembers_path(theta: Floats) -> bool:
    """Return whether an effect or a law remembers the path in any twin; theta: (..., SIZE)."""
    has_effect = bool(np.any(find_active_effects(theta) & _FOLLOWING))
    return has_effect or any(kind.remembers for kind in list_law_kinds(theta))


@kernel.compile_cached
def _fill_path_memory(places, theta, out, loads):  # type: ignore[no-untyped-def]
    p = np.zeros(len(theta) + PATHS)
    p[: len(theta)] = theta
    first = len(theta)
    strains, slots = np.zeros(STRAINS), np.empty(STRAINS, dtype=np.int64)
    elements = np.empty((3, STRAINS))
    counts = list_elements(theta, strains, elements, slots)
    for n in range(len(places)):
        move, turn = places[n] - places[max(n - 1, 0)]
        follow_path(first, move, p, 0, 1)
        follow_strains(elements, counts, move, turn)
        loads[n] = sum_hysteresis(elements, counts, 0.0, 0.0)
        for k in range(PATHS):
            out[n, k] = p[first + k]
            loads[n, 0] += p[first + k]
        keep_strains(elements, slots, counts, strains)
        out[n, KEPT:] = strains


def follow_recorded_path(signals: Signals, places: Floats, theta: Floats) -> tuple[Floats, Floats]:
    """Return what a twin remembers of a path, (n, PATH_SIZE), and what acts by it, (n, 2).

    places: (n, 2) true position of the cart, m, and angle of the pole, rad; theta: (SIZE,).

    A recording begins without memory. What acts: force on the cart, N; torque on the pole, N m.
    """
    memory, loads = np.zeros((len(places), PATH_SIZE)), np.zeros((len(places), 2))
    if remembers_path(theta):
        for part in signals.stretches:
            _fill_path_memory(np.ascontiguousarray(places[part]), theta, memory[part], loads[part])
    return memory, loads
