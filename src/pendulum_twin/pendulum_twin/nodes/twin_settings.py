"""Name the settings of `twin_node`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.settings import (
    check_settings,
    make_flag_field,
    make_number_field,
    make_text_field,
)


@dataclass(frozen=True)
class TwinSettings:
    """Hold the parameters of `twin_node`; a wrong value raises BadInputError."""

    EXAMPLES: ClassVar[tuple[str, ...]] = (
        "twin_node --ros-args -p twin:=config/inteco.yaml",
        "twin_node --ros-args -r __ns:=/twin -p twin:=twin.yaml -p lockstep:=true",
    )

    twin: str = make_text_field(
        "",
        "path of the twin file; set while it runs, the twin goes on with it "
        "from its present state",
        True,
    )
    rate_hz: float = make_number_field(100.0, 1.0, 1000.0, "samples a second")
    command_timeout_s: float = make_number_field(
        0.2, 0.001, 60.0, "without a command for so long, PWM is 0; not in lockstep"
    )
    lockstep: bool = make_flag_field(
        False, "one command in, one sample out, as fast as it goes, with simulated time on /clock"
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.twin:
            raise BadInputError(
                "twin: expected the path of a twin file, found none: give -p twin:=FILE"
            )
