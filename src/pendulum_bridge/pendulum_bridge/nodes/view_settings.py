"""The settings of `view_node`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rclpy.exceptions import InvalidNamespaceException
from rclpy.validate_namespace import validate_namespace

from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.settings import (
    check_settings,
    make_number_field,
    make_text_field,
    make_whole_field,
)

USUAL_PORT = 8077


@dataclass(frozen=True)
class ViewSettings:
    """Hold the checked parameters of `view_node`; each field's text says what it means.

    Raises BadInputError for a wrong type, NaN, or a value out of range.
    """

    EXAMPLES: ClassVar[tuple[str, ...]] = (
        "view_node",
        "view_node --ros-args -p rig:=/rig -p twin:=/twin -p port:=8077",
        "view_node --open --ros-args -p twin_file:=config/inteco.yaml -p recordings:=recordings",
    )

    rig: str = make_text_field("/rig", "namespace of the rig, empty for none")
    twin: str = make_text_field("/twin", "namespace of the twin, empty for none")
    excitation: str = make_text_field(
        "/excitation", "namespace of excitation_node, whose plan the page plays; empty for none"
    )
    recordings: str = make_text_field(
        "recordings", "folder in which the page makes recordings; empty for none"
    )
    twin_file: str = make_text_field(
        "", "the rig's twin file, with which its recordings are diagnosed; empty for no diagnosis"
    )
    host: str = make_text_field(
        "127.0.0.1", "address to listen on; with another one, others may stop and reset the rig"
    )
    port: int = make_whole_field(
        USUAL_PORT,
        0,
        65535,
        "TCP port of the page, 0 for any that is free; where the default is taken, any",
    )
    rail_half_length_m: float = make_number_field(
        0.9, 0.01, 100.0, "from the middle of the rail to its end, as it is drawn"
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if self.rig == self.twin:
            raise BadInputError(
                f"twin: expected another namespace than that of the rig, found {self.twin!r} for "
                "both"
            )
        spaces = {"rig": self.rig, "twin": self.twin, "excitation": self.excitation}
        for name, value in spaces.items():
            try:
                validate_namespace(value or "/")
            except InvalidNamespaceException as error:
                raise BadInputError(
                    f"{name}: expected a namespace such as /{name}, found {value!r}"
                ) from error
        if not self.host:
            raise BadInputError(
                "host: expected an address of this machine, found none: give -p host:=127.0.0.1"
            )
