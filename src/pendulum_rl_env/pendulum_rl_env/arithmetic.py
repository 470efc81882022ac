"""The compiler of this package's numeric functions; they are cached with the kernel they call."""

from __future__ import annotations

from pathlib import Path

from pendulum_twin.machine_code import make_cached_compiler

compiled = make_cached_compiler(
    *(Path(__file__).parent / name for name in ("task.py", "reward.py", "fleet.py"))
)
