"""What the commands print: aligned columns of plain text."""

from __future__ import annotations

from collections.abc import Sequence

from pendulum_sysid.fitting.window_runs import JOINTS, WindowRuns
from pendulum_sysid.fitting.window_runs import UNITS as RUN_UNITS
from pendulum_sysid.records import Comparison, Estimate, Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.model import Twin
from pendulum_twin.rig import UNITS

NOTHING = "-"
SCORE_UNIT = "times the sensors' noise"
Row = tuple[str, ...]


def format_table(header: Row, rows: Sequence[Row]) -> str:
    """Return rows below their header, in columns."""
    lines = [header, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(header))]
    return "\n".join(
        "  ".join(cell.ljust(w) for cell, w in zip(line, widths, strict=True)).rstrip()
        for line in lines
    )


def format_number(value: float | None, digits: int = 4) -> str:
    """Return a number with so many significant digits; a dash for None."""
    return NOTHING if value is None else f"{value:.{digits}g}"


def make_comparison_rows(comparisons: Sequence[Comparison]) -> list[Row]:
    """Return a row a measure: name, each comparison's value, unit; empty measures are left out."""
    measures = (
        ("windows, cart RMSE", [c.cart_rmse_m for c in comparisons], "m"),
        ("windows, pole RMSE", [c.pole_rmse_rad for c in comparisons], "rad"),
        ("windows, score", [c.score for c in comparisons], SCORE_UNIT),
        ("windows, noise floor of the score", [c.noise_floor for c in comparisons], SCORE_UNIT),
        ("whole run, equation 29", [c.thesis_rmse for c in comparisons], ""),
    )
    return [
        (name, *(format_number(value) for value in values), unit)
        for name, values, unit in measures
        if any(value is not None for value in values)
    ]


def make_held_out_rows(
    before: WindowRuns, after: WindowRuns, floors: tuple[float | None, float | None]
) -> list[Row]:
    """Return a row a joint, the score and its noise floor: name, before, after, unit.

    floors: the scores that the twins before and after would reach if they were perfect;
        None where that cannot be measured.
    """
    joints = [
        (f"{JOINTS[joint]} RMSE", format_number(old), format_number(new), RUN_UNITS[joint])
        for joint, old, new in zip(before.channels, before.rmse, after.rmse, strict=True)
    ]
    return [
        *joints,
        ("score", format_number(before.score), format_number(after.score), SCORE_UNIT),
        ("noise floor of the score", *(format_number(floor) for floor in floors), SCORE_UNIT),
    ]


ESTIMATES: Row = ("parameter", "before", "after", "95 % interval", "unit", "identifiable", "")


def make_estimate_rows(before: Twin, fit: Fit) -> list[Row]:
    """Return one row a fitted parameter, as headed by ESTIMATES."""
    return [_make_estimate_row(name, before, estimate) for name, estimate in fit.estimates.items()]


def _make_estimate_row(name: str, before: Twin, estimate: Estimate) -> Row:
    interval = f"[{format_number(estimate.low)}, {format_number(estimate.high)}]"
    warning = "at its bound" if estimate.at_bound else ""
    was, unit = look_up_value(before, name)
    return (
        name,
        format_number(was),
        format_number(estimate.value),
        interval,
        unit,
        "yes" if estimate.identifiable else "no",
        warning,
    )


def look_up_value(twin: Twin, name: str) -> tuple[float | None, str]:
    """Return a twin's value of "key" or "effect.parameter", None if it has none, and the unit."""
    effect, _, parameter = name.partition(".")
    if not parameter:
        return getattr(twin.rig, name), UNITS[name]
    unit = next(p.unit for p in BY_NAME[effect].parameters if p.name == parameter)
    return twin.effects.get(effect, {}).get(parameter), unit
