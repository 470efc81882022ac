"""The INTECO rig by its maker's constants: the rig of programs that are given no twin file."""

from __future__ import annotations

from pathlib import Path

from pendulum_twin.model import Twin, load_twin
from pendulum_twin.rig import Rig

INTECO = Twin(
    "inteco",
    Rig(
        cart_mass_kg=0.5723,
        pole_mass_kg=0.12,
        com_distance_m=0.01955717,
        pole_inertia_kg_m2=0.00292,
        gravity_m_s2=9.81,
        force_per_pwm_n=12.86,
        cart_viscous_n_s_m=0.5,
        pole_viscous_n_m_s=0.00027344,
        rail_half_length_m=0.9,
        pwm_limit=0.5,
    ),
)
DEFAULT = "(default: the INTECO rig by its maker's constants)"  # in the help of an option


def load_twin_or_inteco(path: str | Path | None) -> Twin:
    """Return the twin of a file, the INTECO rig for None; raise BadInputError as `load_twin`."""
    return INTECO if path is None else load_twin(path)
