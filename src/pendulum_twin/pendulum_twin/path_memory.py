"""Follow what remembers the path of the joints along a recorded motion."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from pendulum_twin import kernel
from pendulum_twin.arrays import Floats, Ints, Mask
from pendulum_twin.block import PATH_SIZE
from pendulum_twin.compose import KEPT, PATHS
from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect, Form
from pendulum_twin.hysteresis import (
    STRAINS,
    follow_strains,
    keep_strains,
    list_elements,
    place_elements,
    sum_hysteresis,
)
from pendulum_twin.law_curves import ROLES
from pendulum_twin.laws.kind import REMEMBERING, SENSOR_ERRORS, Role
from pendulum_twin.motion import follow_path
from pendulum_twin.parameter_vector import (
    BASE,
    KIND,
    LAW_SIZE,
    LAWS,
    NEUTRAL,
    SLOTS,
    VALUES,
)
from pendulum_twin.signals import Signals

_REMEMBERS: Mask = np.isin(ROLES, REMEMBERING)  # by the number in a law's slot


def _list_slots(effects: Iterable[Effect]) -> Ints:
    """Return the columns of theta that hold the parameters of effects."""
    return np.array([k for e in effects for k in np.r_[SLOTS[e.name]]], dtype=np.int64)


_PATH_EFFECTS = [e for e in CATALOGUE if e.form is Form.PATH_FORCE]
_SENSORS = [e for e in CATALOGUE if e.form is Form.MEASURE]
_FOLLOWED = _list_slots(_PATH_EFFECTS)
_OF_POLE = _list_slots(e for e in _SENSORS if e.of_joint == "pole")
_OF_ANY = _list_slots(e for e in _SENSORS if not e.of_joint)
_COLUMNS = np.array(
    [
        k
        for e in (*_PATH_EFFECTS, *_SENSORS)
        for k in (*np.r_[SLOTS[e.name]], *(BASE.index(name) for name in e.constants))
    ]
)


def find_remembering_twins(theta: Floats) -> Mask:
    """Return which twins remember the path by an effect or a law, (sets,); theta: (sets, SIZE)."""
    numbers = theta[:, LAWS + KIND :: LAW_SIZE].astype(int)
    effects = np.any(theta[:, _FOLLOWED] != NEUTRAL[_FOLLOWED], axis=1)
    return np.asarray(effects | np.any(_REMEMBERS[numbers], axis=1))


@kernel.compile_cached
def _fill_path_memory(places, theta, wanted, out, loads):  # type: ignore[no-untyped-def]
    """Fill out (k, PATH_SIZE) with the memory at wanted samples (k,), rising; and loads (n, 2)."""
    p = np.zeros(len(theta) + PATHS)
    p[: len(theta)] = theta
    first, row = len(theta), 0
    elements, listed = np.empty((3, STRAINS, 1)), np.empty(STRAINS, dtype=np.int64)
    place_elements(theta, np.zeros(STRAINS), elements, 0)
    counts = list_elements(elements, listed)
    moves, none, pulls = np.empty((2, 1)), np.zeros((2, 1)), np.empty((2, 1))
    for n in range(len(places)):
        moves[:, 0] = places[n] - places[max(n - 1, 0)]
        follow_path(first, moves[0, 0], p, 0, 1)
        follow_strains(elements, listed, counts, moves)
        sum_hysteresis(elements, listed, counts, none, pulls)
        loads[n] = pulls[:, 0]
        for k in range(PATHS):
            loads[n, 0] += p[first + k]
        while row < len(wanted) and wanted[row] == n:
            for k in range(PATHS):
                out[row, k] = p[first + k]
            keep_strains(elements, 0, out[row, KEPT:])
            row += 1


def follow_recorded_path(
    signals: Signals, places: Floats, theta: Floats, at: Ints
) -> tuple[Floats, Floats]:
    """Return what a twin remembers of a path, (k, PATH_SIZE), and what acts by it, (n, 2).

    places: (n, 2) true position of the cart, m, and angle of the pole, rad; theta: (SIZE,).
    at: (k,) samples, rising, whose memory is asked for.

    A recording begins without memory. What acts: force on the cart, N; torque on the pole, N m.
    """
    memory, loads = np.zeros((len(at), PATH_SIZE)), np.zeros((len(places), 2))
    if find_remembering_twins(theta[None])[0]:
        for part in signals.stretches:
            rows = slice(*np.searchsorted(at, (part.start, part.stop)))
            along = np.ascontiguousarray(places[part])
            _fill_path_memory(along, theta, at[rows] - part.start, memory[rows], loads[part])
    return memory, loads


def select_path_columns(theta: Floats) -> Floats:
    """Return what a memory of a recorded path depends on in twins (sets, SIZE), (sets, columns).

    An element of hysteresis is strained by its way alone, whatever its friction; a curve acts on
    the path only where it is an error of a sensor.
    """
    laws = theta[:, LAWS:].copy()
    for slot in range(0, laws.shape[1], LAW_SIZE):
        own = laws[:, slot : slot + LAW_SIZE]
        roles = ROLES[own[:, KIND].astype(int)]
        elements = np.isin(roles, REMEMBERING)
        own[elements, VALUES:] = own[elements, VALUES:] != 0.0
        own[~(elements | np.isin(roles, SENSOR_ERRORS))] = 0.0
    return np.concatenate([theta[:, _COLUMNS], laws], axis=1)


def drop_angle_sensors(theta: Floats) -> Floats:
    """Return twins (sets, SIZE) without sensors of the angle, where none of them is asked for.

    It is asked for where a twin remembers the way of the pole, and where a sensor that is on may
    read both joints.
    """
    roles = ROLES[theta[:, LAWS + KIND :: LAW_SIZE].astype(int)]
    if np.any(roles == Role.POLE_HYSTERESIS) or np.any(theta[:, _OF_ANY] != NEUTRAL[_OF_ANY]):
        return theta
    dropped = theta.copy()
    dropped[:, _OF_POLE] = NEUTRAL[_OF_POLE]
    for slot in range(roles.shape[1]):
        own = dropped[:, LAWS + slot * LAW_SIZE : LAWS + (slot + 1) * LAW_SIZE]
        own[roles[:, slot] == Role.ANGLE_ERROR] = 0.0
    return dropped
