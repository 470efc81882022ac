"""Say what a measured law may be: which quantity, as a curve over which variable, at which place.

A measured law is physics without a name. Its curve is linear in the values at its knots, so a fit
treats the values as any other parameters.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum

from pendulum_twin.effects.effect import Place, Scale


class Variable(IntEnum):
    """The variables that a law may be a curve over; the kernel knows them by number."""

    COMMAND = 0  # as it leaves the command's effects, PWM fraction
    POSITION = 1  # of the cart, m
    VELOCITY = 2  # of the cart, m/s
    ANGLE = 3  # of the pole within a turn, 0 to 2 pi rad; the curve closes on itself
    RATE = 4  # of the pole, rad/s
    TIME = 5  # since the recording began, s
    WAY = 6  # of the cart from where nothing strains it until an element slips, m
    TURN = 7  # of the pole from where nothing strains it until an element slips, rad
    SHAFT = 8  # of the cart within a turn of the shaft that drives it, m; closes on itself, too


class Role(IntEnum):
    """What a law's value does; the kernel knows the roles by number."""

    COMMAND = 0  # is added to the command, PWM fraction
    GAIN = 1  # the force of the drive is multiplied by 1 + value
    FORCE = 2  # is added to the force on the cart, N
    CART_DRAG = 3  # is added to the cart's viscous friction, N s/m
    CART_DRY = 4  # is added to the level of the cart's dry friction, N
    TORQUE = 5  # is added to the torque on the pole, N m
    POLE_DRAG = 6  # is added to the pole's viscous friction, N m s/rad
    POLE_DRY = 7  # is added to the level of the pole's dry friction, N m
    CART_ONE_WAY = 8  # times the speed without its sign, is added to the force on the cart, N s/m
    POLE_ONE_WAY = 9  # times the rate without its sign, is added to the torque, N m s/rad
    CART_HYSTERESIS = 10  # is the friction of an element that strains with the cart, then slips, N
    POLE_HYSTERESIS = (
        11  # is the friction of an element that strains with the pole, then slips, N m
    )
    ANGLE_ERROR = 12  # is added to the measured angle, rad
    POSITION_ERROR = 13  # is added to the measured position, m
    PACE = 14  # the time that passes for a second of the stamps is multiplied by 1 + value


@dataclass(frozen=True)
class Axis:
    """Describe a variable or a quantity of a law.

    words: for a person.
    unit: "1" for a ratio.
    suffix: of its key in twin files; "" for a ratio.
    """

    words: str
    unit: str
    suffix: str


VARIABLES: dict[Variable, Axis] = {
    Variable.COMMAND: Axis("command", "1", ""),
    Variable.POSITION: Axis("cart position", "m", "_m"),
    Variable.VELOCITY: Axis("cart velocity", "m/s", "_m_s"),
    Variable.ANGLE: Axis("pole angle", "rad", "_rad"),
    Variable.RATE: Axis("pole rate", "rad/s", "_rad_s"),
    Variable.TIME: Axis("time", "s", "_s"),
    Variable.WAY: Axis("way until it slips", "m", "_m"),
    Variable.TURN: Axis("turn until it slips", "rad", "_rad"),
    Variable.SHAFT: Axis("cart position within a turn of the shaft", "m", "_m"),
}
EVIDENCE_NAMES: dict[Variable, str] = {
    Variable.COMMAND: "command",
    Variable.POSITION: "cart_position",
    Variable.VELOCITY: "cart_velocity",
    Variable.ANGLE: "pole_angle",
    Variable.RATE: "pole_rate",
    Variable.TIME: "time",
    Variable.WAY: "cart_position",
    Variable.TURN: "pole_angle",
    Variable.SHAFT: "cart_position",
}
QUANTITIES: dict[Role, Axis] = {
    Role.COMMAND: Axis("change of the command", "1", ""),
    Role.GAIN: Axis("change of the force per command, as a share", "1", ""),
    Role.FORCE: Axis("force on the cart", "N", "_n"),
    Role.CART_DRAG: Axis("viscous friction of the cart beyond its constant", "N s/m", "_n_s_m"),
    Role.CART_DRY: Axis("dry friction of the cart", "N", "_n"),
    Role.TORQUE: Axis("torque on the pole", "N m", "_n_m"),
    Role.POLE_DRAG: Axis(
        "viscous friction of the pole beyond its constant", "N m s/rad", "_n_m_s"
    ),
    Role.POLE_DRY: Axis("dry friction of the pole", "N m", "_n_m"),
    Role.CART_ONE_WAY: Axis("one-way drag of the cart", "N s/m", "_n_s_m"),
    Role.POLE_ONE_WAY: Axis("one-way drag of the pole", "N m s/rad", "_n_m_s"),
    Role.CART_HYSTERESIS: Axis("elastic friction of the cart", "N", "_n"),
    Role.POLE_HYSTERESIS: Axis("elastic friction of the pole", "N m", "_n_m"),
    Role.ANGLE_ERROR: Axis("error of the angle", "rad", "_rad"),
    Role.POSITION_ERROR: Axis("error of the position", "m", "_m"),
    Role.PACE: Axis("change of the time between samples, as a share", "1", ""),
}
# What a value is a fraction of, (scale, per): a typical size of each quantity on a rig.
SCALES: dict[Role, tuple[Scale, Scale]] = {
    Role.COMMAND: (Scale.COMMAND, Scale.ONE),
    Role.GAIN: (Scale.ONE, Scale.ONE),
    Role.FORCE: (Scale.FORCE, Scale.ONE),
    Role.CART_DRAG: (Scale.FORCE, Scale.CART_SPEED),
    Role.CART_DRY: (Scale.FORCE, Scale.ONE),
    Role.TORQUE: (Scale.TORQUE, Scale.ONE),
    Role.POLE_DRAG: (Scale.TORQUE, Scale.POLE_RATE),
    Role.POLE_DRY: (Scale.TORQUE, Scale.ONE),
    Role.CART_ONE_WAY: (Scale.FORCE, Scale.CART_SPEED),
    Role.POLE_ONE_WAY: (Scale.TORQUE, Scale.POLE_RATE),
    Role.CART_HYSTERESIS: (Scale.FORCE, Scale.ONE),
    Role.POLE_HYSTERESIS: (Scale.TORQUE, Scale.ONE),
    Role.ANGLE_ERROR: (Scale.ONE, Scale.ONE),
    Role.POSITION_ERROR: (Scale.CART_TRAVEL, Scale.ONE),
    Role.PACE: (Scale.ONE, Scale.ONE),
}
LIMITS: dict[Role, float] = {  # largest value, to either side, that a twin file may give
    Role.COMMAND: 1e6,
    Role.GAIN: 10.0,
    Role.FORCE: 1e6,
    Role.CART_DRAG: 1e6,
    Role.CART_DRY: 1e6,
    Role.TORQUE: 1e6,
    Role.POLE_DRAG: 1e6,
    Role.POLE_DRY: 1e6,
    Role.CART_ONE_WAY: 1e6,
    Role.POLE_ONE_WAY: 1e6,
    Role.CART_HYSTERESIS: 1e6,
    Role.POLE_HYSTERESIS: 1e6,
    Role.ANGLE_ERROR: math.pi,
    Role.POSITION_ERROR: 1e3,
    Role.PACE: 0.5,
}


REMEMBERING = (Role.CART_HYSTERESIS, Role.POLE_HYSTERESIS)  # roles that follow the path
SENSOR_ERRORS = (Role.ANGLE_ERROR, Role.POSITION_ERROR)


@dataclass(frozen=True)
class LawKind:
    """Describe a kind of measured law.

    name: in twin files and verdicts.
    place: where in the chain it acts.
    role: what its value does.
    variable: over which it is a curve.
    of_recording: True for what one recording shows and the rig does not keep: a push at an
        instant. Live twins, training and the watch leave it out.
    """

    name: str
    place: Place
    role: Role
    variable: Variable
    of_recording: bool = False

    @property
    def is_periodic(self) -> bool:
        """Return whether the curve closes on itself after a turn."""
        return self.variable in (Variable.ANGLE, Variable.SHAFT)

    @property
    def remembers(self) -> bool:
        """Return whether the law depends on the way that a joint came.

        Its knots rise by a ratio, not by a spacing: friction may slip after any fraction of the
        way that a joint goes.
        """
        return self.role in REMEMBERING

    @property
    def timed(self) -> bool:
        """Return whether the law counts a recording's time; what runs for hours leaves it out."""
        return self.variable is Variable.TIME

    @property
    def quantity(self) -> Axis:
        """Return what the curve's values are."""
        return QUANTITIES[self.role]

    @property
    def along(self) -> Axis:
        """Return what the curve is drawn along."""
        return VARIABLES[self.variable]

    @property
    def knots_key(self) -> str:
        """Return the key of the knots in twin files."""
        return f"knots{self.along.suffix}"

    @property
    def values_key(self) -> str:
        """Return the key of the values in twin files."""
        return f"values{self.quantity.suffix}"
