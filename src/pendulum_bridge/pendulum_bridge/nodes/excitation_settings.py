"""The settings of `excitation_node`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rclpy.exceptions import InvalidNamespaceException
from rclpy.validate_namespace import validate_namespace

from pendulum_bridge.excitation.guard import NEAR_SHARE, UNEQUAL_PWM, Bounds
from pendulum_twin.errors import BadInputError
from pendulum_twin.nodes.settings import (
    check_settings,
    make_flag_field,
    make_number_field,
    make_text_field,
    make_whole_field,
)
from pendulum_twin.plans.excitation import Excitation, make_standard_plan
from pendulum_twin.plans.plan_file import load_plan
from pendulum_twin.plans.waveforms import Envelope

AUTO, SERVICE = "auto", "service"
# of an emulated rig: after a standstill the rail guard may have to bring the cart back
EMULATED_PATIENCE_S = (2.0, 10.0)


@dataclass(frozen=True)
class ExcitationSettings:
    """Hold the checked parameters of `excitation_node`; each field's text says what it means.

    Raises BadInputError for a wrong type, NaN, or a value out of range.
    """

    EXAMPLES: ClassVar[tuple[str, ...]] = (
        "excitation_node --ros-args -r __ns:=/excitation -p twin_file:=config/inteco.yaml",
        "excitation_node --ros-args -r __ns:=/excitation -p twin_file:=rig.yaml -p "
        "plan:=out/mine/next.yaml",
    )

    plan: str = make_text_field("", "path of a plan file; empty for the standard plan of a minute")
    rate_hz: float = make_number_field(
        100.0,
        10.0,
        1000.0,
        "samples a second that the rig sends, for the standard plan; a plan file has its own",
    )
    twin_file: str = make_text_field(
        "", "path of the rig's twin file: its rail and its largest command"
    )
    rig: str = make_text_field("/rig", "namespace of the rig, whose samples are answered")
    twin: str = make_text_field(
        "/twin", "namespace of the twin that gets the same commands; empty for none"
    )
    start: str = make_text_field(
        AUTO,
        "when to begin: as soon as all is ready, or when the service asks",
        choices=(AUTO, SERVICE),
    )
    reset_first: bool = make_flag_field(True, "whether rig and twin are reset before the plan")
    reset_when_away: bool = make_flag_field(
        False,
        "without reset_first: whether a cart that is away from the middle is reset; else the plan "
        "does not begin then",
    )
    exit_when_done: bool = make_flag_field(
        True, "whether the node ends with the plan; else it can be started again"
    )
    listeners: int = make_whole_field(
        1,
        1,
        20,
        "how many nodes must listen to the rig's pwm before the start: 2 waits for a recorder too",
    )
    rail_share: float = make_number_field(
        0.95, 0.01, 1.0, "of the rail's half length; beyond it the plan is stopped"
    )
    cart_limit_m_s: float = make_number_field(5.0, 0.001, 1000.0, "a faster cart stops the plan")
    pole_limit_rad_s: float = make_number_field(
        40.0, 0.001, 1000.0, "a faster pole stops the plan"
    )
    silence_s: float = make_number_field(
        0.2, 0.01, 60.0, "so long without a sample stops the plan"
    )
    overruled_s: float = make_number_field(
        0.5, 0.01, 60.0, "another command than the requested one for so long stops the plan"
    )
    emulated: bool = make_flag_field(
        False,
        "a rig on this computer, which may stand still: silence_s is at least 2 s and "
        "overruled_s at least 10 s",
    )
    ready_timeout_s: float = make_number_field(
        120.0, 0.1, 3600.0, "longest wait for rig and twin, which may compile first"
    )
    reset_timeout_s: float = make_number_field(30.0, 0.1, 3600.0, "longest wait for each reset")

    @property
    def patience_s(self) -> tuple[float, float]:
        """The times that hold, of silence and of another command, s."""
        silence, overruled = EMULATED_PATIENCE_S if self.emulated else (0.0, 0.0)
        return max(self.silence_s, silence), max(self.overruled_s, overruled)

    def __post_init__(self) -> None:
        check_settings(self)
        if not self.twin_file:
            raise BadInputError(
                "twin_file: expected the path of the rig's twin file, found none: give -p "
                "twin_file:=FILE"
            )
        if not self.rig:
            raise BadInputError("rig: expected a namespace such as /rig, found none")
        for name in ("rig", "twin"):
            object.__setattr__(self, name, _normalize_namespace(name, getattr(self, name)))
        if self.rig == self.twin:
            raise BadInputError(
                f"twin: expected another namespace than that of the rig, found {self.twin} for "
                "both"
            )


def choose_plan(settings: ExcitationSettings, room: Envelope) -> Excitation:
    """Return the plan of the file, or the standard plan at the rig's rate.

    Raises BadInputError when the file cannot be used.
    """
    if settings.plan:
        return load_plan(settings.plan, room)
    return make_standard_plan(room, rate_hz=settings.rate_hz)


def make_bounds(settings: ExcitationSettings, room: Envelope) -> Bounds:
    """Return what a rig may do while a plan is played."""
    return Bounds(
        settings.rail_share * room.half_length_m,
        NEAR_SHARE * room.half_length_m,
        settings.cart_limit_m_s,
        settings.pole_limit_rad_s,
        *settings.patience_s,
        UNEQUAL_PWM * room.unit,
    )


def _normalize_namespace(name: str, value: str) -> str:
    """Return a namespace that begins with a slash; an empty namespace stays empty."""
    if not value:
        return value
    absolute = "/" + value.strip("/")
    try:
        validate_namespace(absolute)
    except InvalidNamespaceException as error:
        raise BadInputError(
            f"{name}: expected a namespace such as /{name}, found {value!r}"
        ) from error
    if absolute == "/":  # the topics there would collide with the node's own
        raise BadInputError(f"{name}: expected a namespace such as /{name}, found {value!r}")
    return absolute
