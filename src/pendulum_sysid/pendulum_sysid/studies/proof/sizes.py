"""Compare estimates with the truth: sizes of effects and constants of the rig, with intervals."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from pendulum_sysid.studies.proof.records import Seal, Size
from pendulum_twin.effects import BY_NAME
from pendulum_twin.rig import Rig, parse_rig

RIG = "rig"


def compare_effect_sizes(
    seal: Seal, missing_physics: Sequence[Mapping[str, Any]], scale: float = 1.0
) -> tuple[Size, ...]:
    """Return every parameter of the concealed effects that were named as what they are.

    A time that is read off the recording to a sample has no interval and is left out.

    missing_physics: as in verdict.json.
    scale: see `compute_mass_scale`.
    """
    return tuple(
        _compare(
            Size(
                entry["effect"],
                p.name,
                p.unit,
                p.shape,
                *_read_values(truth.get(p.name, p.neutral), estimate),
            ),
            scale,
        )
        for entry in missing_physics
        if (truth := seal.effects.get(entry["effect"])) is not None
        for p in BY_NAME[entry["effect"]].parameters
        if not p.located and (estimate := entry["parameters"].get(p.name)) is not None
    )


def compare_rig_constants(
    seal: Seal, rig_parameters: Mapping[str, Mapping[str, Any]], scale: float = 1.0
) -> tuple[Size, ...]:
    """Return every constant that the verdict calls identifiable.

    rig_parameters: as in verdict.json.
    scale: see `compute_mass_scale`.
    """
    return tuple(
        _compare(
            Size(
                RIG,
                name,
                entry["unit"],
                False,
                *_read_values(seal.rig[name], {**entry, "value": entry["after"]}),
            ),
            scale,
        )
        for name, entry in rig_parameters.items()
        if entry["identifiable"] and name in seal.rig
    )


def compute_mass_scale(seal: Seal, nominal: Rig) -> float:
    """Return what true forces and inertias are multiplied by to stand beside estimates.

    Motion fixes only their ratios to the mass, and the mass stays as the nominal twin has it.
    """
    true = parse_rig(dict(seal.rig)).total_mass_kg
    return nominal.total_mass_kg / true if true else 1.0


def describe_deviation(size: Size) -> str:
    """Return "right" where the interval holds the truth, else how far off the estimate is."""
    if size.inside:
        return "right"
    if not size.true:
        return f"off by {size.value:+.2g} {size.unit}".removesuffix(" 1")
    return f"off by {100 * (size.value - size.true) / abs(size.true):+.2g} %"


def _read_values(true: float, estimate: Mapping[str, Any]) -> tuple[float, float, float, float]:
    """Return truth, estimate, and the ends of its interval; an end that is null is infinite."""
    missing = {"value": math.nan, "low": -math.inf, "high": math.inf}
    value, low, high = (
        default if estimate[key] is None else float(estimate[key])
        for key, default in missing.items()
    )
    return float(true), value, low, high


def _compare(size: Size, scale: float) -> Size:
    """Return the size with its truth on the estimate's scale and, for an angle, in its turn."""
    if size.unit.split(" ")[0].split("/")[0] in ("N", "kg"):
        size = replace(size, true=size.true * scale)
    if size.shape and size.unit == "rad" and math.isfinite(size.value):
        turns = round((size.value - size.true) / (2 * math.pi))
        size = replace(size, true=size.true + 2 * math.pi * turns)
    return size
