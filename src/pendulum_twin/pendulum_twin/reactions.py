"""Let the cart act back on the drive along a recorded motion, to know how runs begin."""

from __future__ import annotations

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.compose import KEPT, PATHS
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.motion import react_to_push, sum_pulls, sum_shares
from pendulum_twin.parameter_vector import FORCE_PER_PWM, MASS, NEUTRAL, SLOTS
from pendulum_twin.sensors import compute_paces
from pendulum_twin.signals import Signals

REACTING: Mask = np.array([e.reaction is not None for e in CATALOGUE])
_COLUMNS = np.concatenate([np.r_[SLOTS[e.name]] for e in CATALOGUE if e.reaction is not None])


def find_reacting_twins(theta: Floats) -> Mask:
    """Return in which twins the cart acts back on the drive, (sets,); theta: (sets, SIZE)."""
    return np.any(theta[:, _COLUMNS] != NEUTRAL[_COLUMNS], axis=1)


def select_reaction_columns(theta: Floats) -> Floats:
    """Return what reactions along a path depend on beside path and drive, (sets, columns).

    theta: (sets, SIZE).
    """
    constants = theta[:, [MASS, FORCE_PER_PWM]]
    return np.column_stack([constants, theta[:, _COLUMNS], compute_paces(theta)])


@kernel.compile_cached
def _fill_accelerations(x, period_s, out):  # type: ignore[no-untyped-def]
    """Fill out (n,) with the second derivatives, m/s^2, of the natural cubic spline through x.

    Elimination in a tridiagonal system: a[n - 1] + 4 a[n] + a[n + 1] = 6 x''[n] by differences.
    """
    count = len(x)
    carried = np.zeros(count)
    out[0] = out[-1] = 0.0
    for n in range(1, count - 1):
        difference = 6.0 * (x[n + 1] - 2.0 * x[n] + x[n - 1]) / (period_s * period_s)
        pivot = 4.0 - carried[n - 1]
        carried[n] = 1.0 / pivot
        out[n] = (difference - out[n - 1]) / pivot
    for n in range(count - 2, 0, -1):
        out[n] -= carried[n] * out[n + 1]


@kernel.compile_cached
def _fill_reactions(accelerations, drive, h, theta, out):  # type: ignore[no-untyped-def]
    sub = len(drive) // len(accelerations)
    p = np.zeros(len(theta) + out.shape[1])
    p[: len(theta)] = theta
    first, mass = len(theta), theta[MASS]
    cart_share = 1.0 - sum_shares(p, 0, 1)
    for n in range(len(accelerations) - 1):
        for k in range(out.shape[1]):
            out[n, k] = p[first + k]
        for j in range(sub):
            way = (j + 0.5) / sub
            a = (1.0 - way) * accelerations[n] + way * accelerations[n + 1]
            passed_on = theta[FORCE_PER_PWM] * drive[n * sub + j]
            pull = sum_pulls(first, p, 0, 1)
            push = cart_share * (mass * a - passed_on) + pull
            react_to_push(first, push, h, p, 0, 1)
    for k in range(out.shape[1]):
        out[-1, k] = p[first + k]


def react_to_recorded_path(signals: Signals, x: Floats, drive: Floats, theta: Floats) -> Floats:
    """Return what reactions of the drive keep along a path, (n, KEPT - PATHS); 0 where it begins.

    The path between samples is a cubic spline. What the sensor's noise leaves in the drive fades
    with its own swing, and its part in a force is small by the drive's share of the mass.

    x: (n,) m, true positions.
    drive: (n * substeps,) the command after command and drive, before the gain.
    theta: (SIZE,).
    """
    out = np.zeros((len(x), KEPT - PATHS))
    sub, pace = len(drive) // len(x), float(compute_paces(theta))
    period_s = signals.period_s * pace
    for stretch in signals.stretches:
        accelerations = np.empty(stretch.stop - stretch.start)
        _fill_accelerations(np.ascontiguousarray(x[stretch]), period_s, accelerations)
        part = slice(stretch.start * sub, stretch.stop * sub)
        _fill_reactions(accelerations, drive[part], period_s / sub, theta, out[stretch])
    return out
