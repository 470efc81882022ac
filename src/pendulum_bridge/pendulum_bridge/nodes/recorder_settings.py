"""The settings of `recorder_node`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from pendulum_twin.bags.mcap_file import COMPRESSIONS
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.settings import (
    check_settings,
    make_flag_field,
    make_list_field,
    make_number_field,
    make_text_field,
)
from pendulum_twin.topics import APPLIED_PWM, DIAGNOSTICS, JOINT_STATES, PWM

NAMESPACES = ("/rig", "/twin")
TOPICS = (
    *(f"{space}/{name}" for space in NAMESPACES for name in (JOINT_STATES, PWM, APPLIED_PWM)),
    DIAGNOSTICS,
)


@dataclass(frozen=True)
class RecorderSettings:
    """Hold the checked parameters of `recorder_node`; each field's text says what it means.

    Raises BadInputError for a wrong type, NaN, or a value out of range.
    """

    EXAMPLES: ClassVar[tuple[str, ...]] = (
        "recorder_node --ros-args -p out:=recordings/monday -p seconds:=70.0",
        "recorder_node --recover recordings/monday",
    )

    out: str = make_text_field("", "the folder to write, a new one")
    topics: tuple[str, ...] = make_list_field(TOPICS, "what to record")
    seconds: float = make_number_field(
        0.0, 0.0, 1e6, "how long from the first message; 0: until stopped"
    )
    compression: str = make_text_field("none", "of the chunks", choices=tuple(COMPRESSIONS))
    least_free_mb: float = make_number_field(
        200.0, 0.0, 1e9, "stop when less is free on the disk, 10^6 bytes"
    )
    twin: str = make_text_field("", "a twin file to keep with the recording")
    plan: str = make_text_field("", "the excitation plan, a file to keep with the recording")
    driver: str = make_text_field("", "the driver's parameters, a file to keep with the recording")
    outcome: str = make_text_field(
        "/excitation/outcome", "topic on which excitation_node says how its plan stands"
    )
    doctor: str = make_text_field(
        "", "the doctor's report (rig_doctor --move --json), a file to keep with the recording"
    )
    end_with_parent: bool = make_flag_field(
        False, "end the recording when the program that started the node has ended"
    )
    note: str = make_text_field("", "a remark to keep with the recording")

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.out:
            raise BadInputError(
                "out: expected the folder to write, found none: give -p out:=FOLDER"
            )
        if not self.topics:
            raise BadInputError("topics: expected at least one topic, found none")
