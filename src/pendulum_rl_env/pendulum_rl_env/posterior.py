"""What a diagnosis leaves possible: twins drawn from its intervals, and how finely the rig measures.

Randomisation needs no invented ranges: a verdict says how well each number is known. Numbers are
drawn independently, normal, with the interval as +-1.96 deviations; the verdict tells no
correlations, so the draws are wider than what the recording allows, never narrower.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_twin.effects import BY_NAME
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.files import read_json_object
from pendulum_twin.model import Twin

INTERVAL_DEVIATIONS = 1.96  # of a 95 % interval
WIDEST_SHARE = (
    0.2  # times a rig's constant: one that the recording does not fix is not spread further
)
SCHEMA = "pendulum_verdict/1"


@dataclass(frozen=True)
class Knowledge:
    """Hold the twins to learn on, the best estimate first, and the encoders."""

    twins: tuple[Twin, ...]
    encoders: Encoders


def gather_knowledge(twin: Twin, verdict: Path | None, draws: int, seed: int) -> Knowledge:
    """Return the twin alone, or with a verdict (JSON) so many drawn from its intervals beside it; raise BadInputError."""
    if verdict is None:
        return Knowledge((twin,), EXACT)
    told = read_json_object(verdict, SCHEMA, "a verdict")
    random = np.random.default_rng(seed)
    return Knowledge(
        (twin, *(_draw_twin(twin, told, random) for _ in range(draws))), _read_encoders(told)
    )


def _draw_twin(twin: Twin, told: Mapping[str, Any], random: np.random.Generator) -> Twin:
    """Return a twin with every number drawn from its interval."""
    rig = twin.rig
    for name, known in told.get("rig_parameters", {}).items():
        value = getattr(rig, name, None)
        if value:
            deviation = min(_compute_deviation(known), WIDEST_SHARE * abs(value))
            drawn = value + deviation * random.standard_normal()
            rig = replace(rig, **{name: max(drawn, 0.1 * value) if value > 0 else drawn})
    effects = {name: dict(values) for name, values in twin.effects.items()}
    for name, parameter, known in _list_parameters(told):
        if parameter in effects.get(name, {}):
            bounds = next(p for p in BY_NAME[name].parameters if p.name == parameter)
            drawn = effects[name][parameter] + _compute_deviation(known) * random.standard_normal()
            effects[name][parameter] = float(np.clip(drawn, bounds.low, bounds.high))
    return Twin(twin.name, rig, effects)


def _list_parameters(told: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    for missing in told.get("missing_physics", []):
        for parameter, known in missing.get("parameters", {}).items():
            yield missing["effect"], parameter, known


def _compute_deviation(known: Mapping[str, Any]) -> float:
    """Return the standard deviation behind an interval; 0 when there is none."""
    low, high = known.get("low"), known.get("high")
    if low is None or high is None or not np.isfinite([low, high]).all():
        return 0.0
    return max(float(high) - float(low), 0.0) / (2 * INTERVAL_DEVIATIONS)


def _read_encoders(told: Mapping[str, Any]) -> Encoders:
    recording = told.get("recording", {})
    return Encoders(
        float(recording.get("position_step_m") or 0.0),
        float(recording.get("angle_step_rad") or 0.0),
    )
