"""The settings of `watch_node`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rclpy.exceptions import InvalidNamespaceException
from rclpy.validate_namespace import validate_namespace

from pendulum_bridge.watch.watch import Settings
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.settings import (
    check_settings,
    make_flag_field,
    make_number_field,
    make_text_field,
)


@dataclass(frozen=True)
class WatchSettings:
    """Hold the checked parameters of `watch_node`; each field's text says what it means.

    Raises BadInputError for a wrong type, NaN, or a value out of range.
    """

    EXAMPLES: ClassVar[tuple[str, ...]] = ("watch_node --ros-args -p twin:=out/mine/twin.yaml",)

    twin: str = make_text_field(
        "",
        "path of the twin file that the rig is held against; set while it runs, it learns anew",
        True,
    )
    rig: str = make_text_field("/rig", "namespace of the rig that is watched")
    rate_hz: float = make_number_field(100.0, 20.0, 1000.0, "samples a second that the rig sends")
    learn_s: float = make_number_field(
        20.0, 5.0, 3600.0, "seconds of motion from which it learns what is usual"
    )
    false_alarm_h: float = make_number_field(
        1000.0, 0.1, 1e6, "hours between false alarms, at least in the mean"
    )
    simulated: bool = make_flag_field(
        False,
        "whether a twin stands in the rig's place: what it applied counts from its last sample on",
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.twin:
            raise BadInputError(
                "twin: expected the path of a twin file, found none: give -p twin:=FILE"
            )
        try:
            validate_namespace(self.rig)
        except InvalidNamespaceException as error:
            raise BadInputError(
                f"rig: expected a namespace such as /rig, found {self.rig!r}"
            ) from error

    @property
    def watching(self) -> Settings:
        """Return how to watch."""
        return Settings(self.rate_hz, self.learn_s, self.false_alarm_h, self.simulated)
