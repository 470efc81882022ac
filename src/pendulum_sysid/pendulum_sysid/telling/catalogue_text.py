"""The catalogue of effects as the command line lists it."""

from __future__ import annotations

from pendulum_twin.effects import CATALOGUE
from pendulum_twin.effects.effect import Effect


def format_catalogue() -> str:
    """Return the catalogue for a person, in the order of the chain."""
    return "\n\n".join(_format_effect(effect) for effect in CATALOGUE)


def _format_effect(effect: Effect) -> str:
    lines = [
        f"{effect.name} ({effect.place.value})",
        f"    {effect.sentence.replace('{', '').replace('}', '')}",
    ]
    for p in effect.parameters:
        lines.append(
            f"    {p.name} [{p.unit}]: from {p.low:g} to {p.high:g}, vanishes at {p.neutral:g}"
        )
    if not effect.searched:
        lines.append("    Only for twin files: no diagnosis names it.")
    return "\n".join([*lines, f"    Source: {effect.source}"])


def make_catalogue_mapping() -> dict:
    """Return the catalogue in JSON's types; sentences hold the parameters' names in braces."""
    return {"effects": [_make_effect_mapping(effect) for effect in CATALOGUE]}


def _make_effect_mapping(effect: Effect) -> dict:
    parameters = [
        {"name": p.name, "unit": p.unit, "neutral": p.neutral, "low": p.low, "high": p.high}
        for p in effect.parameters
    ]
    return {
        "name": effect.name,
        "place": effect.place.value,
        "parameters": parameters,
        "searched": effect.searched,
        "sentence": effect.sentence,
        "source": effect.source,
    }
