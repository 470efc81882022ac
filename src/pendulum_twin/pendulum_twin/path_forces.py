"""Follow forces that depend on the path of the cart along a recorded motion."""

from __future__ import annotations

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.compose import PATHS
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Form
from pendulum_twin.motion import follow_path
from pendulum_twin.parameter_vector import find_active_effects
from pendulum_twin.signals import Signals

_FOLLOWING: Mask = np.array([e.form is Form.PATH_FORCE for e in CATALOGUE])


def have_path_forces(theta: Floats) -> bool:
    """Return whether a force follows the path in any twin; theta: (..., SIZE)."""
    return bool(np.any(find_active_effects(theta) & _FOLLOWING))


@kernel.compile_cached
def _fill_path_forces(x, theta, out):  # type: ignore[no-untyped-def]
    p = np.zeros(len(theta) + out.shape[1])
    p[: len(theta)] = theta
    first = len(theta)
    for n in range(len(x)):
        follow_path(first, x[n] - x[max(n - 1, 0)], p, 0, 1)
        for k in range(out.shape[1]):
            out[n, k] = p[first + k]


def follow_recorded_path(signals: Signals, x: Floats, theta: Floats) -> Floats:
    """Return the forces on the cart (N) that follow its path, (n, PATHS); 0 where it begins.

    x: (n,) m, true positions; theta: (SIZE,).
    """
    out = np.zeros((len(x), PATHS))
    if have_path_forces(theta):
        for stretch in signals.stretches:
            _fill_path_forces(np.ascontiguousarray(x[stretch]), theta, out[stretch])
    return out
