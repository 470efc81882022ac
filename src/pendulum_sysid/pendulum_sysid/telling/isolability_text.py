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


def format_isolability(isolability: Isolability) -> str:
    """Return both tables for a person, with what their columns mean."""
    encoders = isolability.encoders
    lines = [
        f"{isolability.twin}: {isolability.seconds:g} s, cart up to "
        f"{isolability.farthest_m:.2g} m from the middle, {encoders.pole_counts} counts a turn, "
        f"cart steps of {1e6 * encoders.cart_step_m:.3g} um",
        "",
        format_table(HEADER, [_format_row(row) for row in isolability.rows]),
        "",
        f"found from: stands {decisions.SURE_STANDARD_ERRORS:g} standard errors out of the "
        "encoders' noise, beside all of the rig's constants.",
        "named from: a diagnosis will name it, which decides on windows that it did not fit.",
        "not told from: in any size it comes nearer than "
        f"{decisions.APART_STANDARD_ERRORS:g} standard errors, by a fit in the effect's place.",
        "-: shows nothing beside what this twin holds. All is as far as noise goes: what else a "
        "model lacks hides more.",
        "",
        format_table(CONSTANTS, [_format_constant(c) for c in isolability.constants]),
    ]
    return "\n".join(lines)


def make_isolability_mapping(isolability: Isolability) -> dict[str, Any]:
    """Return the same in JSON's types."""
    return {"schema": SCHEMA, **asdict(isolability)}


def _format_row(row: EffectRow) -> tuple[str, ...]:
    inseparable = [*row.not_told_from, *(name + MOTION for name in row.by_no_motion)]
    names = ", ".join(inseparable) or NOTHING
    if row.parameter is None:
        return (row.effect, ALWAYS, *[""] * 4, names)
    sizes = (row.typical[row.parameter], row.found_from, row.named_from)
    shown = (format_number(size, 2) for size in sizes)
    return (row.effect, row.parameter, row.unit, *shown, names)


def _format_constant(constant: Constant) -> tuple[str, ...]:
    return (
        constant.name,
        format_number(constant.value),
        constant.unit,
        f"+-{format_number(constant.half_width, 2)}",
        "yes" if constant.identifiable else "no",
    )
