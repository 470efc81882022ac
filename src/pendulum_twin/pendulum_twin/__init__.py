"""Digital twin of a cart-pendulum rig: measured constants, believed effects, one compiled kernel.

>>> import numpy as np
>>> from pendulum_twin import Rig, Twin, simulate
>>> pole = Rig(
...     pole_mass_kg=0.1, com_distance_m=0.2, pole_inertia_kg_m2=0.005, pole_viscous_n_m_s=0.0
... )
>>> t = np.arange(0.0, 2.0, 0.01)
>>> run = simulate(Twin("pole", pole), t, np.zeros(len(t)), start=(0.0, np.pi - 0.2, 0.0, 0.0))
>>> f"{run.pole.min():.2f} to {run.pole.max():.2f} rad"
'2.94 to 3.34 rad'
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from pendulum_twin.version import __version__

if TYPE_CHECKING:
    from pendulum_twin.effects import CATALOGUE
    from pendulum_twin.errors import BadInputError, ReportedError, RigError
    from pendulum_twin.model import Twin, load_twin, save_twin
    from pendulum_twin.rig import Rig
    from pendulum_twin.simulation import Simulation, simulate

__all__ = [
    "CATALOGUE",
    "BadInputError",
    "ReportedError",
    "Rig",
    "RigError",
    "Simulation",
    "Twin",
    "__version__",
    "load_twin",
    "save_twin",
    "simulate",
]

_HOMES = {
    "pendulum_twin.effects": ("CATALOGUE",),
    "pendulum_twin.errors": ("BadInputError", "ReportedError", "RigError"),
    "pendulum_twin.model": ("Twin", "load_twin", "save_twin"),
    "pendulum_twin.rig": ("Rig",),
    "pendulum_twin.simulation": ("Simulation", "simulate"),
}
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name on first use: a small program that needs one module loads no numpy."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return list(__all__)
