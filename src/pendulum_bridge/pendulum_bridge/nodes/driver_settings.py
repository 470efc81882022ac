"""The settings of `driver_node`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pendulum_bridge.wire.udp import RIG, USER
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.settings import (
    check_settings,
    make_flag_field,
    make_number_field,
    make_text_field,
    make_whole_field,
)

# An emulated rig can take no harm, and stands still whenever its computer is busy.
EMULATED_TIMEOUT_S = 2.0
SILENT_PERIODS = 1.5  # shortest silence: the next sample must have been due


@dataclass(frozen=True)
class DriverSettings:
    """Hold the checked parameters of `driver_node`; each field's text says what it means.

    Raises BadInputError for a wrong type, NaN, or a value out of range.
    """

    EXAMPLES: ClassVar[tuple[str, ...]] = (
        "driver_node --ros-args -r __ns:=/rig -p twin:=config/inteco.yaml",
        "driver_node --ros-args -r __ns:=/rig -p twin:=rig.yaml -p rig_host:=192.168.1.7 "
        "-p listen_host:=0.0.0.0",
    )

    twin: str = make_text_field(
        "", "path of the twin file: the rig's constants, for rail guard and reset, and its signs"
    )
    transport: str = make_text_field("udp", "how to talk to the rig", choices=("udp", "tcp"))
    rig_host: str = make_text_field(RIG.host, "host name or IPv4 address of the rig")
    rig_port: int = make_whole_field(RIG.port, 1, 65535, "port on which the rig takes commands")
    listen_host: str = make_text_field(
        USER.host, "address on which samples are taken; beyond loopback only when named here (udp)"
    )
    listen_port: int = make_whole_field(
        USER.port, 1, 65535, "port on which samples are taken (udp)"
    )
    rate_hz: float = make_number_field(100.0, 10.0, 1000.0, "samples a second that the rig sends")
    pwm_limit: float = make_number_field(
        0.5, 0.001, 1.0, "largest PWM fraction; the twin file's where that is lower", live=True
    )
    slew_per_s: float = make_number_field(
        50.0, 0.1, 10000.0, "largest change of the PWM fraction in a second", live=True
    )
    command_timeout_s: float = make_number_field(
        0.2, 0.01, 60.0, "without a command for so long, PWM is 0"
    )
    rig_timeout_s: float = make_number_field(
        0.2, 0.01, 60.0, "without a sample for so long, PWM is 0 and the rig counts as silent"
    )
    reset_deadline_s: float = make_number_field(
        20.0, 1.0, 600.0, "a reset that takes longer is given up"
    )
    emulated: bool = make_flag_field(
        False, "a rig on this computer, which may stand still: both timeouts are at least 2 s"
    )
    autostart: bool = make_flag_field(
        True, "configure and activate by itself; else `ros2 lifecycle set` does it"
    )
    end_with_parent: bool = make_flag_field(
        True, "end, with PWM 0, when the program that started the node has ended"
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.twin:
            raise BadInputError(
                "twin: expected the path of a twin file, found none: give -p twin:=FILE"
            )
        if self.rig_timeout_s * self.rate_hz < SILENT_PERIODS:
            raise BadInputError(
                f"rig_timeout_s: expected at least {SILENT_PERIODS:g} periods of the "
                f"{self.rate_hz:g} Hz of rate_hz, "
                f"found {self.rig_timeout_s:g} s"
            )

    @property
    def timeouts_s(self) -> tuple[float, float]:
        """The timeouts that hold, of a command and of a sample, s."""
        least = EMULATED_TIMEOUT_S if self.emulated else 0.0
        return max(self.command_timeout_s, least), max(self.rig_timeout_s, least)

    @property
    def wire(self) -> str:
        """The addresses between which packets go."""
        if self.transport == "tcp":
            return f"tcp, rig {self.rig_host}:{self.rig_port}"
        return (
            f"udp, rig {self.rig_host}:{self.rig_port}, samples to "
            f"{self.listen_host}:{self.listen_port}"
        )
