"""What a planned recording will show, as the command line prints it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from pendulum_sysid import decisions
from pendulum_sysid.planning.isolability import Constant, EffectRow, Isolability
from pendulum_sysid.telling.tables import NOTHING, format_number, format_table

SCHEMA = "pendulum_isolability/1"
HEADER = (
    "effect",
    "size",
    "unit",
    "typical",
    "found from",
    "named from",
    "not told from, at the typical size",
)
CONSTANTS = ("rig constant", "value", "unit", "95 % interval", "identifiable")
ALWAYS = "on or off"
MOTION = " (by no motion)"


def format_isolability(found: Isolability) -> str:
    """Return both tables for a person, with what their columns mean."""
    lines = [
        f"{found.twin}: {found.seconds:g} s, cart up to {found.farthest_m:.2g} m from the middle, "
        f"{found.encoders.pole_counts} counts a turn, cart steps of {1e6 * found.encoders.cart_step_m:.3g} um",
        "",
        format_table(HEADER, [_format_row(one) for one in found.rows]),
        "",
        f"found from: stands {decisions.FOUND_STANDARD_ERRORS:g} standard errors out of the encoders' noise, beside all of the rig's constants.",
        "named from: a diagnosis will name it, which decides on windows that it did not fit.",
        f"not told from: in any size it comes nearer than {decisions.APART_STANDARD_ERRORS:g} standard errors, by a fit in the effect's place.",
        "-: shows nothing beside what this twin holds. All is as far as noise goes: what else a model lacks hides more.",
        "",
        format_table(CONSTANTS, [_format_constant(one) for one in found.constants]),
    ]
    return "\n".join(lines)


def make_isolability_mapping(found: Isolability) -> dict[str, Any]:
    """Return the same in JSON's types."""
    return {"schema": SCHEMA, **asdict(found)}


def _format_row(one: EffectRow) -> tuple[str, ...]:
    tied = [*one.not_told_from, *(name + MOTION for name in one.by_no_motion)]
    if one.parameter is None:
        return (one.effect, ALWAYS, *[""] * 4, ", ".join(tied) or NOTHING)
    sizes = (one.typical[one.parameter], one.found_from, one.named_from)
    shown = (format_number(size, 2) for size in sizes)
    return (one.effect, one.parameter, one.unit, *shown, ", ".join(tied) or NOTHING)


def _format_constant(one: Constant) -> tuple[str, ...]:
    return (
        one.name,
        format_number(one.value),
        one.unit,
        f"+-{format_number(one.half_width, 2)}",
        "yes" if one.identifiable else "no",
    )
