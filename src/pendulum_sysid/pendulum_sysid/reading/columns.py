"""Which columns of a laboratory's file hold what, and in which units."""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from pathlib import Path

from pendulum_sysid.errors import WrongUse

ZEROS = {"up": 0.0, "down": math.pi}  # where the file's angle is 0 -> what it is called here
LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}
ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180.0, "turn": 2.0 * math.pi}
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
COMMAND_UNITS = {"one": 1.0, "percent": 1e-2, "per_mille": 1e-3}
# fields of Columns that name one of a few
CHOICES = {
    "pole_zero": tuple(ZEROS),
    "length_unit": tuple(LENGTH_UNITS),
    "angle_unit": tuple(ANGLE_UNITS),
    "time_unit": tuple(TIME_UNITS),
    "command_unit": tuple(COMMAND_UNITS),
    "command_acts": ("after", "before"),
}
# times since 1970 of the years 2001 to 2286, by their unit: no log lasts so long
EPOCH_S = (1e9, 1e10)


@dataclass(frozen=True)
class Columns:
    """Say which columns hold what, and in which units; a column by name or number.

    time: sampling times from any zero; None with rate_hz.
    command: what was sent to the drive; only a pole alone may lack it.
    cart, pole: positions; at least one. A wrapped angle stays wrapped.
    pole_zero: where the angle is 0, up or (pi is added) down.
    skip: s to leave out at the beginning.
    invert_cart, invert_pole: turn the sign of position and velocity round.
    rate_hz: Hz, of rows without times.
    cart_velocity, pole_velocity: as reported, a length or angle in its unit a second.
    sin, cos: of the angle, in place of pole.
    command_acts: "after" where the command of a row acts until the next row; "before" where it
        acted until that row, from the row before.
    join: file that holds the command instead, with times of the same clock.
    join_time: column of its times; None for a column of the same name as time.
    segment: column whose value says which run a row belongs to.
    length_unit, angle_unit, time_unit, command_unit: keys of LENGTH_UNITS and so on. Without a
        time unit, times count seconds, or a whole part of a second since 1970.
    """

    time: str | None = None
    command: str | None = None
    cart: str | None = None
    pole: str | None = None
    pole_zero: str = "up"
    skip: float = 0.0
    invert_cart: bool = False
    invert_pole: bool = False
    rate_hz: float | None = None
    cart_velocity: str | None = None
    pole_velocity: str | None = None
    sin: str | None = None
    cos: str | None = None
    join: Path | None = None
    join_time: str | None = None
    segment: str | None = None
    length_unit: str = "m"
    angle_unit: str = "rad"
    time_unit: str | None = None
    command_unit: str = "one"
    command_acts: str = "after"


def check_columns(columns: Columns) -> None:
    """Raise WrongUse where the columns do not make a recording together."""
    _check_choices(columns)
    if columns.join is not None and (columns.time is None or columns.command is None):
        raise WrongUse(
            "expected --time and --command beside --join, found one missing: the clock of both "
            "files says when a command was sent"
        )
    if columns.join is None and columns.join_time is not None:
        raise WrongUse(
            "expected --join FILE beside --join-time, found none: name the file with the commands"
        )
    if columns.join is not None and columns.command_acts == "before":
        raise WrongUse(
            "expected the command's column in the file itself with --command-acts before, found "
            "--join: its times say when a command acts"
        )
    if refusal := find_clock_refusal(columns.time, columns.rate_hz):
        raise WrongUse(refusal)
    if columns.rate_hz is not None and not 0.0 < columns.rate_hz < math.inf:
        raise WrongUse(f"expected --rate above 0, found {columns.rate_hz}: give the rows a second")
    if (columns.sin is None) != (columns.cos is None) or (columns.sin and columns.pole):
        raise WrongUse("expected --pole, or --sin and --cos together: give the angle one way")
    has_pole = columns.pole is not None or columns.sin is not None
    if columns.cart is None and not has_pole:
        raise WrongUse(
            "expected a position column, found neither --cart nor --pole: name at least one"
        )
    if columns.cart is not None and columns.command is None:
        raise WrongUse(
            "expected the command column of a recording with a cart, found none: name it with "
            "--command"
        )
    if (columns.cart_velocity and columns.cart is None) or (
        columns.pole_velocity and not has_pole
    ):
        raise WrongUse("expected a position beside every velocity: name it with --cart or --pole")


def _check_choices(columns: Columns) -> None:
    """Raise WrongUse for a unit or the like that is neither a choice nor the default."""
    defaults = {field.name: field.default for field in fields(Columns)}
    for name, choices in CHOICES.items():
        value = getattr(columns, name)
        if value != defaults[name] and value not in choices:
            raise WrongUse(
                f"expected --{name.replace('_', '-')} {', '.join(choices[:-1])} or {choices[-1]}, "
                f"found {value}: name one of these, or leave the option out"
            )


def find_clock_refusal(time: str | None, rate_hz: float | None) -> str | None:
    """Return why a file's clock is not given in exactly one way; None where it is."""
    if (time is None) != (rate_hz is None):
        return None
    if time is None:
        return (
            "expected --time COLUMN, or --rate HZ for a file without times, found neither: "
            "say when the rows were taken"
        )
    return "expected --time COLUMN or --rate HZ, found both: leave out the wrong one"
