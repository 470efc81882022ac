"""Fits made of errors alone, for tests of the judge."""

from collections.abc import Mapping

import numpy as np

from pendulum_sysid.records import Estimate, Fit
from pendulum_twin.arrays import Floats
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig

SAMPLES, NOISE = 101.0, np.array([1e-4, 1e-3])
POLE = Twin(
    "pole",
    Rig(pole_mass_kg=0.1, com_distance_m=0.1, pole_inertia_kg_m2=0.003, pole_viscous_n_m_s=1e-4),
)


def make_errors(seed: int, size: float = 3.0, windows: int = 15) -> Floats:
    """Return root mean square errors of windows, some calm and some wild, in units of noise."""
    return size * np.random.default_rng(seed).lognormal(0.0, 0.5, (windows, 2))


def make_fit(
    off: Floats, effects: tuple[str, ...] = (), estimates: Mapping[str, Estimate] | None = None
) -> Fit:
    """Return a fit with errors (windows, channels) in units of noise."""
    squares = SAMPLES * (off * NOISE) ** 2
    choose = float(np.exp(0.5 * np.mean(np.log(squares.mean(axis=0) / SAMPLES / NOISE**2))))
    empty = np.empty(0)
    return Fit(
        POLE,
        effects,
        dict(estimates or {}),
        empty,
        empty,
        empty,
        choose,
        choose,
        squares,
        np.full(off.shape, SAMPLES),
        NOISE,
    )
