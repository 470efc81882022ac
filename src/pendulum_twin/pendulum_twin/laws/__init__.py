"""List every kind of law that a twin may hold as a measured curve, in the order of the chain.

To add a kind, add a line: the kernel, twin files, fits and reports know it from then on.
"""

from __future__ import annotations

from pendulum_twin.effects.effect import Place
from pendulum_twin.laws.kind import LawKind, Role, Variable

KINDS: tuple[LawKind, ...] = (
    LawKind("command_curve", Place.COMMAND, Role.COMMAND, Variable.COMMAND),
    LawKind("drive_gain_over_time", Place.COMMAND, Role.GAIN, Variable.TIME),
    LawKind("drive_gain_along_rail", Place.DRIVE, Role.GAIN, Variable.POSITION),
    LawKind("drive_gain_over_shaft_turn", Place.DRIVE, Role.GAIN, Variable.SHAFT),
    LawKind("drive_gain_by_velocity", Place.DRIVE, Role.GAIN, Variable.VELOCITY),
    LawKind("cart_force_by_position", Place.CART, Role.FORCE, Variable.POSITION),
    LawKind("cart_force_over_shaft_turn", Place.CART, Role.FORCE, Variable.SHAFT),
    LawKind("cart_force_by_velocity", Place.CART, Role.FORCE, Variable.VELOCITY),
    LawKind("cart_force_by_angle", Place.CART, Role.FORCE, Variable.ANGLE),
    LawKind("cart_force_over_time", Place.CART, Role.FORCE, Variable.TIME, of_recording=True),
    LawKind("cart_drag_along_rail", Place.CART, Role.CART_DRAG, Variable.POSITION),
    LawKind("cart_drag_by_pole_rate", Place.CART, Role.CART_DRAG, Variable.RATE),
    LawKind("cart_drag_by_angle", Place.CART, Role.CART_DRAG, Variable.ANGLE),
    LawKind("cart_drag_over_time", Place.CART, Role.CART_DRAG, Variable.TIME),
    LawKind("cart_one_way_drag_along_rail", Place.CART, Role.CART_ONE_WAY, Variable.POSITION),
    LawKind("cart_dry_friction_along_rail", Place.CART, Role.CART_DRY, Variable.POSITION),
    LawKind("cart_dry_friction_by_velocity", Place.CART, Role.CART_DRY, Variable.VELOCITY),
    LawKind("cart_dry_friction_over_time", Place.CART, Role.CART_DRY, Variable.TIME),
    LawKind("cart_dry_friction_by_pole_rate", Place.CART, Role.CART_DRY, Variable.RATE),
    LawKind("cart_dry_friction_by_angle", Place.CART, Role.CART_DRY, Variable.ANGLE),
    LawKind("cart_hysteresis", Place.CART, Role.CART_HYSTERESIS, Variable.WAY),
    LawKind("pole_torque_by_angle", Place.POLE, Role.TORQUE, Variable.ANGLE),
    LawKind("pole_torque_by_rate", Place.POLE, Role.TORQUE, Variable.RATE),
    LawKind("pole_torque_by_position", Place.POLE, Role.TORQUE, Variable.POSITION),
    LawKind("pole_torque_over_time", Place.POLE, Role.TORQUE, Variable.TIME, of_recording=True),
    LawKind("pole_drag_over_time", Place.POLE, Role.POLE_DRAG, Variable.TIME),
    LawKind("pole_drag_by_angle", Place.POLE, Role.POLE_DRAG, Variable.ANGLE),
    LawKind("pole_drag_by_cart_velocity", Place.POLE, Role.POLE_DRAG, Variable.VELOCITY),
    LawKind("pole_one_way_drag_by_angle", Place.POLE, Role.POLE_ONE_WAY, Variable.ANGLE),
    LawKind("pole_dry_friction_by_angle", Place.POLE, Role.POLE_DRY, Variable.ANGLE),
    LawKind("pole_dry_friction_by_rate", Place.POLE, Role.POLE_DRY, Variable.RATE),
    LawKind("pole_dry_friction_over_time", Place.POLE, Role.POLE_DRY, Variable.TIME),
    LawKind("pole_hysteresis", Place.POLE, Role.POLE_HYSTERESIS, Variable.TURN),
    LawKind("angle_error_over_turn", Place.SENSOR, Role.ANGLE_ERROR, Variable.ANGLE),
    LawKind("position_error_along_rail", Place.SENSOR, Role.POSITION_ERROR, Variable.POSITION),
    LawKind("position_error_over_shaft_turn", Place.SENSOR, Role.POSITION_ERROR, Variable.SHAFT),
    LawKind("clock_pace_over_time", Place.CLOCK, Role.PACE, Variable.TIME),
)
BY_NAME: dict[str, LawKind] = {kind.name: kind for kind in KINDS}
