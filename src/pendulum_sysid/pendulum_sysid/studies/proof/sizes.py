"""Put estimates beside the truth: sizes of effects and constants of the rig, each with its interval."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from pendulum_sysid.studies.proof.records import OpenedTrial, Size
from pendulum_twin.effects import BY_NAME
from pendulum_twin.rig import Rig, parse_rig

RIG = "rig"


def compare_effect_sizes(
    sealed: OpenedTrial, missing_physics: list[Mapping[str, Any]], scale: float = 1.0
) -> tuple[Size, ...]:
    """Return every parameter of the concealed effects that were named as what they are, with its estimate.

    missing_physics: as in the verdict. scale: see `compute_mass_scale`.
    """
    return tuple(
        _size(
            one["effect"],
            p.name,
            p.unit,
            p.shape,
            sealed.effects[one["effect"]][p.name],
            one["parameters"][p.name],
            scale,
        )
        for one in missing_physics
        if one["effect"] in sealed.effects
        for p in BY_NAME[one["effect"]].parameters
        if p.name in one["parameters"]
        and not p.located  # a time that is read off to a sample has no interval
    )


def compare_rig_constants(
    sealed: OpenedTrial, rig_parameters: Mapping[str, Mapping[str, Any]], scale: float = 1.0
) -> tuple[Size, ...]:
    """Return every constant that the verdict calls identifiable, with its estimate."""
    return tuple(
        _size(
            RIG, name, one["unit"], False, sealed.rig[name], {**one, "value": one["after"]}, scale
        )
        for name, one in rig_parameters.items()
        if one["identifiable"] and name in sealed.rig
    )


def compute_mass_scale(sealed: OpenedTrial, nominal: Rig) -> float:
    """Return what true forces and inertias are multiplied by in estimates that rest on the nominal mass.

    Motion fixes only ratios to the mass, which stays as the twin file has it.
    """
    true = parse_rig(dict(sealed.rig)).total_mass_kg
    return nominal.total_mass_kg / true if true else 1.0


def _size(
    owner: str,
    name: str,
    unit: str,
    shape: bool,
    true: float,
    found: Mapping[str, Any],
    scale: float,
) -> Size:
    with_mass = unit.split(" ")[0].split("/")[0] in ("N", "kg")
    one = Size(
        owner,
        name,
        unit,
        shape,
        float(true) * (scale if with_mass else 1.0),
        *(
            _number(found[key], missing)
            for key, missing in (("value", math.nan), ("low", -math.inf), ("high", math.inf))
        ),
    )
    return _same_turn(one) if shape and unit == "rad" else one


def _number(value: float | None, missing: float) -> float:
    return missing if value is None else float(value)


def _same_turn(one: Size) -> Size:
    """Return a phase with its truth moved by whole turns to where the estimate is."""
    turns = round((one.value - one.true) / (2 * math.pi)) if math.isfinite(one.value) else 0
    return replace(one, true=one.true + 2 * math.pi * turns)
