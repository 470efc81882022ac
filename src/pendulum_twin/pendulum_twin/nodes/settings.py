"""Keep a node's settings as a frozen dataclass, and declare its fields as ROS parameters.

Each field is made by `make_number_field`, `make_whole_field`, `make_text_field`, `make_list_field`
or `make_flag_field`, and `__post_init__` calls `check_settings`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import Field, field, fields, replace
from typing import Any, ClassVar, Protocol

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    SetParametersResult,
)
from rclpy.node import Node
from rclpy.parameter import Parameter

from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.overrides import check_overrides
from pendulum_twin.rig import check_number
from pendulum_twin.suggest import add_hint

Check = Callable[[str, Any], Any]


class Settings(Protocol):
    """Allow any dataclass with examples of the node's command line."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    EXAMPLES: ClassVar[tuple[str, ...]]


def make_number_field(
    default: float, low: float, high: float, text: str, live: bool = False
) -> Any:
    """Return a field for a number from low to high; a whole number is taken, too.

    text: describes the parameter.
    live: whether it may change while the node runs.
    """
    return _make_field(
        default, text, live, lambda name, value: check_number(name, value, low, high), (low, high)
    )


def make_whole_field(default: int, low: int, high: int, text: str, live: bool = False) -> Any:
    """Return a field for a whole number from low to high."""

    def check(name: str, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise BadInputError(
                f"{name}: expected a whole number from {low} to {high}, found {value!r}"
            )
        return value

    return _make_field(default, text, live, check, (low, high))


def make_text_field(
    default: str, text: str, live: bool = False, choices: tuple[str, ...] = ()
) -> Any:
    """Return a field for text; choices: what it may be, everything when empty."""

    def check(name: str, value: Any) -> str:
        if not isinstance(value, str):
            raise BadInputError(f"{name}: expected text, found {value!r}")
        if choices and value not in choices:
            raise BadInputError(
                f"{name}: expected one of {', '.join(choices)}, found {value!r}"
                f"{add_hint(value, choices)}"
            )
        return value

    return _make_field(default, f"{text} ({', '.join(choices)})" if choices else text, live, check)


def make_list_field(default: tuple[str, ...], text: str, live: bool = False) -> Any:
    """Return a field for texts; a single text is taken for a list of one."""

    def check(name: str, value: Any) -> tuple[str, ...]:
        texts = [value] if isinstance(value, str) else value
        if not isinstance(texts, list | tuple) or not all(
            isinstance(entry, str) for entry in texts
        ):
            raise BadInputError(f"{name}: expected a list of texts, found {value!r}")
        return tuple(texts)

    return _make_field(default, text, live, check)


def make_flag_field(default: bool, text: str, live: bool = False) -> Any:
    """Return a field for true or false."""

    def check(name: str, value: Any) -> bool:
        if not isinstance(value, bool):
            raise BadInputError(f"{name}: expected true or false, found {value!r}")
        return value

    return _make_field(default, text, live, check)


def _make_field(
    default: Any, text: str, live: bool, check: Check, span: tuple[float, float] | None = None
) -> Any:
    return field(
        default=default, metadata={"text": text, "live": live, "check": check, "span": span}
    )


def check_settings(settings: Settings) -> None:
    """Check every field and convert it to its type; raise BadInputError for a wrong value."""
    for item in fields(settings):
        object.__setattr__(
            settings, item.name, item.metadata["check"](item.name, getattr(settings, item.name))
        )


def declare_settings[S: Settings](node: Node, kind: type[S]) -> S:
    """Declare the parameters on a node and return its settings.

    Raises BadInputError for a wrong value, and for a parameter that was given and is none of them.
    """
    anything = ParameterDescriptor(dynamic_typing=True)  # a wrong type gets our own sentence
    values = {
        item.name: node.declare_parameter(item.name, item.default, anything).value
        for item in fields(kind)
    }
    check_overrides(node)
    settings = kind(**values)
    for item in fields(kind):
        node.set_descriptor(item.name, _make_descriptor(item))
    return settings


def watch_settings[S: Settings](
    node: Node, current: Callable[[], S], accept: Callable[[S], None]
) -> None:
    """Hand changed settings to accept.

    current: returns the settings now.
    accept: takes the new settings, or raises BadInputError to refuse them; then nothing changes.
    """

    def change(parameters: list[Parameter]) -> SetParametersResult:
        known = {item.name for item in fields(current())}
        given = {p.name: p.value for p in parameters if p.name in known}
        try:
            if given:  # not when it is one of rclpy's own parameters
                accept(replace(current(), **given))
        except BadInputError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    node.add_on_set_parameters_callback(change)


def _make_descriptor(item: Field[Any]) -> ParameterDescriptor:
    span, whole_numbers = item.metadata["span"], isinstance(item.default, int)
    descriptor = ParameterDescriptor(
        description=item.metadata["text"], read_only=not item.metadata["live"], dynamic_typing=True
    )
    if span and whole_numbers:
        descriptor.integer_range = [IntegerRange(from_value=span[0], to_value=span[1])]
    elif span:
        descriptor.floating_point_range = [
            FloatingPointRange(from_value=span[0], to_value=span[1])
        ]
    return descriptor


def describe_settings(kind: type[Settings]) -> str:
    """Return the parameters as lines of help."""
    return "\n".join(
        f"  {item.name:<20} {item.metadata['text']}{_format_range(item)}" for item in fields(kind)
    )


def _format_range(item: Field[Any]) -> str:
    if item.metadata["span"] is None:
        return f" (default {_format_default(item.default)})" if item.default != "" else ""
    low, high = item.metadata["span"]
    return f" ({low:g} to {high:g}; default {item.default:g})"


def _format_default(default: Any) -> str:
    return ", ".join(default) if isinstance(default, tuple) else str(default).lower()
