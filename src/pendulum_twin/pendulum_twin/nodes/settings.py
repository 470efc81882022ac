"""The node's settings: a frozen dataclass on one side, ROS parameters with ranges and descriptions on the other."""

from __future__ import annotations

from dataclasses import Field, dataclass, field, fields
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.node import Node

from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import checked_number


def _number(default: float, low: float, high: float, text: str) -> Any:
    return field(default=default, metadata={"text": text, "range": (low, high)})


@dataclass(frozen=True)
class TwinSettings:
    """Hold the parameters of `twin_node`, checked: a wrong type, NaN or out of range raises BadInputError."""

    twin: str = field(default="", metadata={"text": "path of the twin file"})
    rate_hz: float = _number(100.0, 1.0, 1000.0, "samples a second")
    command_timeout_s: float = _number(0.2, 0.001, 60.0, "without a command for so long, PWM is 0")

    def __post_init__(self) -> None:
        for each in fields(self):
            object.__setattr__(self, each.name, _checked(each, getattr(self, each.name)))
        if not self.twin:
            raise BadInputError("twin: expected the path of a twin file, found none: give -p twin:=FILE")


def _checked(each: Field[Any], value: object) -> object:
    if "range" in each.metadata:
        return checked_number(each.name, value, *each.metadata["range"])
    if not isinstance(value, str):
        raise BadInputError(f"{each.name}: expected text, found {value!r}")
    return value


def declared(node: Node) -> TwinSettings:
    """Declare the parameters on a node and return the settings that were given; raise BadInputError for a wrong one.

    An int for a double is accepted. They cannot be changed while the node runs.
    """
    anything = ParameterDescriptor(dynamic_typing=True)  # so that a wrong one gets our own sentence
    values: dict[str, Any] = {
        each.name: node.declare_parameter(each.name, each.default, anything).value for each in fields(TwinSettings)
    }
    settings = TwinSettings(**values)
    for each in fields(TwinSettings):
        node.set_descriptor(each.name, _descriptor(each))
    return settings


def _descriptor(each: Field[Any]) -> ParameterDescriptor:
    limits = each.metadata.get("range")
    return ParameterDescriptor(
        description=each.metadata["text"],
        read_only=True,
        dynamic_typing=True,
        floating_point_range=[FloatingPointRange(from_value=limits[0], to_value=limits[1])] if limits else [],
    )


def described() -> str:
    """Return the parameters as lines of help."""
    return "\n".join(f"  {each.name:<20} {each.metadata['text']}{_span(each)}" for each in fields(TwinSettings))


def _span(each: Field[Any]) -> str:
    if "range" not in each.metadata:
        return ""
    low, high = each.metadata["range"]
    return f" ({low:g} to {high:g}; default {each.default:g})"
