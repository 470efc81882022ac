"""The good recordings of which degraded recordings are made, each of the same concealed rigs."""

from __future__ import annotations

from pathlib import Path

from pendulum_twin.plans.plan_file import Plan, save_plan
from pendulum_twin.plans.plan_phases import Chirp, Push, Rest

PLAN, CLOSED, FAST, SLOW = "plan", "closed", "fast", "slow"
SLOW_PLAN = Plan(
    phases=(
        Push(),
        Chirp(seconds=40.0, from_hz=0.05, to_hz=0.2, amplitude=0.12),
        Rest(seconds=8.0, centred=True),
    ),
    name="slow",
)
OPTIONS: dict[str, tuple[str, ...]] = {
    PLAN: ("--seconds", "60"),
    CLOSED: ("--seconds", "60", "--closed-loop"),
    FAST: ("--seconds", "40", "--rate-hz", "10000"),
    SLOW: (),
}


def list_recorder_options(base: str, folder: Path) -> list[str]:
    """Return the options of the recorder's command line for a base.

    folder: of the study, where the plan of the slow motion is written.
    """
    if base != SLOW:
        return list(OPTIONS[base])
    path = folder / "slow_plan.yaml"
    if not path.exists():
        save_plan(SLOW_PLAN, path)
    return ["--plan", str(path)]
