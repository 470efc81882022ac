"""System identification of a cart-pendulum: what a twin lacks, and by how much.

Record a rig, or simulate one, and ask what its twin gets wrong. All names below load on first use.

>>> import numpy as np
>>> import pendulum_sysid as ps
>>> twin = ps.load_twin("config/inteco.yaml")
>>> t = np.arange(0.0, 12.0, 0.01)
>>> command = 0.12 * np.sin(2.0 * np.pi * (0.4 + 0.03 * t) * t)
>>> run = ps.simulate(twin, t, command)
>>> noise = np.random.default_rng(1).normal(0.0, [5e-5, 1e-3], (len(t), 2))
>>> recording = ps.Recording.from_arrays(
...     t, command, run.cart + noise[:, 0], run.pole + noise[:, 1]
... )
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pendulum_sysid.api import compare, diagnose, fit, read_recording, replay
    from pendulum_sysid.fitting.compare import Pair
    from pendulum_sysid.records import Comparison, Fit, Outcome, Recording
    from pendulum_sysid.verdict.record import Verdict
    from pendulum_twin.model import Twin, load_twin, save_twin
    from pendulum_twin.simulation import Simulation, simulate

__version__ = "0.1.0"

__all__ = [
    "Comparison",
    "Fit",
    "Outcome",
    "Pair",
    "Recording",
    "Simulation",
    "Twin",
    "Verdict",
    "compare",
    "diagnose",
    "fit",
    "load_twin",
    "read_recording",
    "replay",
    "save_twin",
    "simulate",
]

_HOMES = {
    "pendulum_sysid.api": (
        "compare", "diagnose", "fit", "read_recording", "replay",
    ),
    "pendulum_sysid.records": ("Comparison", "Fit", "Outcome", "Recording"),
    "pendulum_sysid.verdict.record": ("Verdict",),
    "pendulum_sysid.fitting.compare": ("Pair",),
    "pendulum_twin.simulation": ("Simulation", "simulate"),
    "pendulum_twin.model": ("Twin", "load_twin", "save_twin"),
}  # fmt: skip
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name on first use, so that `import pendulum_sysid` stays fast."""
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    value = getattr(import_module(_HOME_OF[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Return the public names."""
    return sorted([*__all__, "__version__"])
