"""The rigs that a diagnosis leaves possible: twins drawn from the intervals of its verdict.

Randomisation needs no invented ranges: a verdict says how well each number is known, and how their
errors are correlated. The numbers are drawn from a joint normal distribution: +-1.96 of its
standard deviations are the interval of each number, its correlations those of the verdict. What
the verdict correlates with nothing is drawn independently.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.encoders import EXACT, Encoders
from pendulum_twin.errors import BadInputError
from pendulum_twin.files import read_json_object
from pendulum_twin.model import Twin
from pendulum_twin.rig import Rig
from pendulum_twin.schemas import VERDICT

INTERVAL_DEVIATIONS = 1.96  # half a 95 % interval, in standard deviations
WIDEST_SHARE = 0.2  # of a rig's constant: the widest draw, for what the recording does not fix
MOST_TRIES = 1000  # for constants that bodies can have together
SAME_SHARE = 0.02  # by which the same number may differ between two files
LEAST_SHARE = 0.1  # of a positive constant: no draw is smaller


@dataclass(frozen=True)
class Knowledge:
    """Hold what is known of a rig.

    twins: the best estimate first, then the draws.
    encoders: how finely the rig measures.
    """

    twins: tuple[Twin, ...]
    encoders: Encoders


def gather_knowledge(twin: Twin, verdict: Path | None, draws: int, seed: int) -> Knowledge:
    """Return the twins and encoders that a diagnosis leaves possible.

    twin: the best estimate.
    verdict: JSON file of the diagnosis; None for the twin alone with exact encoders.
    draws: how many twins to draw.
    seed: of the draws.

    Raises BadInputError when the file is no verdict, is one of another twin, or says that the
    recording could not be used.
    """
    if verdict is None:
        return Knowledge((twin,), EXACT)
    content = read_json_object(verdict, VERDICT, "a verdict")
    random = np.random.default_rng(seed)
    try:
        _check_verdict(twin, content)
        drawn = [_draw_twin(twin, content, random) for _ in range(draws)]
        return Knowledge((twin, *drawn), _read_encoders(content))
    except BadInputError as error:
        raise BadInputError(f"{verdict}: {error}") from error
    except (KeyError, TypeError, ValueError, AttributeError, StopIteration) as error:
        raise BadInputError(
            f"{verdict}: expected what {VERDICT} holds, found {error!r} missing or odd"
        ) from error


def _check_verdict(twin: Twin, verdict: Mapping[str, Any]) -> None:
    """Raise BadInputError when a verdict's intervals are not about this twin."""
    if verdict.get("outcome") == "unusable":
        raise BadInputError(
            "expected a verdict with intervals, found that the recording could not be used: "
            "leave out --verdict, or record again"
        )
    sizes = [
        (name, getattr(twin.rig, name, None), entry["after"], entry)
        for name, entry in verdict.get("rig_parameters", {}).items()
    ]
    sizes += [
        (f"{effect}.{name}", twin.effects.get(effect, {}).get(name), entry["value"], entry)
        for effect, name, entry in _list_parameters(verdict)
    ]
    for name, there, here, entry in sizes:
        if there is None or here is None:
            continue
        allowed = max(_compute_deviation(entry), SAME_SHARE * abs(there))
        if not abs(float(here) - there) <= allowed:
            raise BadInputError(
                f"expected the verdict of this twin, found {name} {float(here):.4g} in the "
                f"verdict and {there:.4g} in the twin: give the twin.yaml that stands beside it"
            )


def _draw_twin(twin: Twin, verdict: Mapping[str, Any], random: np.random.Generator) -> Twin:
    """Return a twin with every number drawn; constants that no bodies have are drawn again."""
    names, root = _read_correlations(verdict)
    for _ in range(MOST_TRIES):
        deviations = _Deviations(names, root @ random.standard_normal(len(names)), random)
        rig = _draw_rig(twin.rig, verdict.get("rig_parameters", {}), deviations)
        if rig is not None:
            return replace(twin, rig=rig, effects=_draw_effects(twin, verdict, deviations))
    raise BadInputError(
        f"expected intervals in which bodies can be, found none in {MOST_TRIES} draws: "
        "leave out --verdict"
    )


class _Deviations:
    """Give each number how many standard deviations it is off, others than the named at random."""

    def __init__(self, names: Sequence[str], values: Floats, random: np.random.Generator) -> None:
        self._values, self._random = dict(zip(names, values.tolist(), strict=True)), random

    def get(self, name: str) -> float:
        """Return the deviations of a number, the same whenever it is asked about."""
        return self._values.setdefault(name, float(self._random.standard_normal()))


def _read_correlations(verdict: Mapping[str, Any]) -> tuple[list[str], Floats]:
    """Return names (n,), and a root (n, n) of their correlations; what is not fixed has none."""
    content = verdict.get("correlations") or {"names": [], "values": []}
    names = [str(name) for name in content["names"]]
    matrix = np.array(content["values"], dtype=np.float64).reshape(len(names), len(names))
    matrix = np.where(np.isfinite(matrix), matrix, 0.0)
    np.fill_diagonal(matrix, 1.0)
    values, vectors = np.linalg.eigh(0.5 * (matrix + matrix.T))
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return names, root / np.linalg.norm(root, axis=1, keepdims=True)


def _draw_effects(
    twin: Twin, verdict: Mapping[str, Any], deviations: _Deviations
) -> dict[str, dict[str, float]]:
    effects = {name: dict(values) for name, values in twin.effects.items()}
    for name, parameter, estimate in _list_parameters(verdict):
        if parameter in effects.get(name, {}) and estimate.get("identifiable", True):
            bounds = next(p for p in BY_NAME[name].parameters if p.name == parameter)
            away = _compute_deviation(estimate) * deviations.get(f"{name}.{parameter}")
            drawn = effects[name][parameter] + away
            effects[name][parameter] = float(np.clip(drawn, bounds.low, bounds.high))
    return effects


def _draw_rig(rig: Rig, estimates: Mapping[str, Any], deviations: _Deviations) -> Rig | None:
    """Return a rig with every constant drawn; None when no bodies have these."""
    constants = {}
    for name, estimate in estimates.items():
        value = getattr(rig, name, None)
        if value:
            deviation = min(_compute_deviation(estimate), WIDEST_SHARE * abs(value))
            drawn = value + deviation * deviations.get(name)
            constants[name] = max(drawn, LEAST_SHARE * value) if value > 0 else drawn
    try:
        return replace(rig, **constants)
    except BadInputError:
        return None


def _list_parameters(verdict: Mapping[str, Any]) -> Iterator[tuple[str, str, Mapping[str, Any]]]:
    """Yield effect, parameter and estimate of the twin's effects: given, and named."""
    for name, values in verdict.get("effect_parameters", {}).items():
        effect, _, parameter = name.partition(".")
        yield effect, parameter, {**values, "value": values["after"]}
    for missing in verdict.get("missing_physics", []):
        for parameter, estimate in missing.get("parameters", {}).items():
            yield missing["effect"], parameter, estimate


def _compute_deviation(estimate: Mapping[str, Any]) -> float:
    """Return the standard deviation behind an interval; 0 without an interval."""
    low, high = estimate.get("low"), estimate.get("high")
    if low is None or high is None or not np.isfinite([low, high]).all():
        return 0.0
    return max(float(high) - float(low), 0.0) / (2 * INTERVAL_DEVIATIONS)


def _read_encoders(verdict: Mapping[str, Any]) -> Encoders:
    recording = verdict.get("recording", {})
    return Encoders(
        float(recording.get("position_step_m") or 0.0),
        float(recording.get("angle_step_rad") or 0.0),
    )
