"""Declare the keys of a plan file: fields of frozen dataclasses that check their values.

Each field is made by `make_number_key`, `make_whole_key`, `make_flag_key` or `make_numbers_key`,
and `__post_init__` calls `check_keys`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import MISSING, Field, field, fields
from reprlib import repr as shown
from typing import Any, ClassVar, Protocol

from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import check_number


class Keyed(Protocol):
    """Allow any dataclass whose fields are keys."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


def make_number_key(low: float, high: float, default: Any = MISSING) -> Any:
    """Return a key for a number from low to high; without a default it has to be given."""
    return _make_key(lambda name, value: check_range(name, value, low, high), default)


def make_whole_key(low: int, high: int, default: Any = MISSING) -> Any:
    """Return a key for a whole number from low to high."""

    def check(name: str, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise BadInputError(
                f"{name}: expected a whole number from {low} to {high}, found {shown(value)}"
            )
        return value

    return _make_key(check, default)


def make_flag_key(default: bool) -> Any:
    """Return a key for true or false."""

    def check(name: str, value: Any) -> bool:
        if not isinstance(value, bool):
            raise BadInputError(f"{name}: expected true or false, found {shown(value)}")
        return value

    return _make_key(check, default)


def make_numbers_key(low: float, high: float, most: int, default: Any = MISSING) -> Any:
    """Return a key for a list of 1 to `most` numbers from low to high."""

    def check(name: str, value: Any) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or not 1 <= len(value) <= most:
            raise BadInputError(
                f"{name}: expected a list of 1 to {most} numbers, found {shown(value)}"
            )
        return tuple(
            check_range(f"{name}[{k}]", number, low, high) for k, number in enumerate(value)
        )

    return _make_key(check, default)


def check_keys(keyed: Keyed) -> None:
    """Check every key and convert it to its type; raise BadInputError for a wrong value."""
    for key in fields(keyed):
        value = key.metadata["check"](key.name, getattr(keyed, key.name))
        object.__setattr__(keyed, key.name, value)


def check_range(name: str, value: Any, low: float, high: float) -> float:
    """Return a value as a float; raise BadInputError when it is no finite number in [low, high].

    Lists are refused here, for a YAML file of a few lines can hold a list whose text never ends.
    So are whole numbers that are too large for a float.
    """
    if isinstance(value, list | tuple | dict | set):
        raise BadInputError(f"{name}: expected a number, found {shown(value)}")
    if isinstance(value, int) and not low <= value <= high:
        raise BadInputError(
            f"{name}: expected a number from {low:g} to {high:g}, found {shown(value)}"
        )
    return check_number(name, value, low, high)


def _make_key(check: Callable[[str, Any], Any], default: Any) -> Any:
    return field(default=default, metadata={"check": check})
