"""The table of unlisted physics: place, variables and sizes of each.

Each entry names the place of the chain where it acts and the variables on which the missing force
(torque, sensor error) depends.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from pendulum_bridge.emulator.unlisted.cart_laws import (
    make_drag_chain,
    make_dragged_cable,
    make_draught,
    make_fanned_cart,
    make_half_rail_friction,
    make_hanging_cable,
    make_leaning_guide,
    make_outward_brake,
    make_warming_friction,
)
from pendulum_bridge.emulator.unlisted.drive_laws import (
    make_crossover_amplifier,
    make_gain_along_rail,
    make_gain_falling_with_speed,
    make_recovering_battery,
    make_supply_ripple,
)
from pendulum_bridge.emulator.unlisted.extra import Extra
from pendulum_bridge.emulator.unlisted.pole_laws import (
    make_air_jet,
    make_bearing_hysteresis,
    make_bearing_notch,
    make_oily_bearing,
    make_pole_magnet,
    make_stirred_air,
    make_taut_cable,
)
from pendulum_bridge.emulator.unlisted.sensor_laws import (
    make_bent_rack,
    make_clock_wander,
    make_kinked_tape,
    make_wobbling_disc,
)
from pendulum_twin.errors import BadInputError
from pendulum_twin.suggest import hint_at_names

Span = tuple[float, float]


@dataclass(frozen=True)
class Unlisted:
    """Describe one piece of unlisted physics.

    make: returns its laws for a rig and its parameters.
    place: of the chain where it acts.
    variables: on which the missing force, torque or error depends.
    sizes: parameter -> lowest and highest size drawn (unit: see the parameter's name).
    both_ways: whether the sign of a size is drawn too.
    shapes: parameters that say where or how, not how much.
    neutral: the size at which it vanishes.
    """

    make: Callable[..., Extra]
    place: str
    variables: tuple[str, ...]
    sizes: Mapping[str, Span]
    both_ways: bool = False
    shapes: tuple[str, ...] = ()
    neutral: float = 0.0

    @property
    def name(self) -> str:
        """Return the name by which it is concealed."""
        return self.make.__name__.removeprefix("make_")


PHASE_SIZES = {"phase_rad": (-3.1, 3.1)}
WAVE_SHAPES = ("frequency_hz", "period_s", "period_m", "phase_rad")

TABLE: tuple[Unlisted, ...] = (
    Unlisted(
        make_gain_along_rail,
        "drive",
        ("command", "cart_position"),
        {"per_m": (0.5, 1.2)},
        both_ways=True,
    ),
    Unlisted(
        make_gain_falling_with_speed,
        "drive",
        ("command", "cart_velocity"),
        {"s_per_m": (0.2, 0.5)},
    ),
    Unlisted(
        make_supply_ripple,
        "command",
        ("command", "time"),
        {"ratio": (0.1, 0.3), "frequency_hz": (0.1, 0.3), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
    Unlisted(make_warming_friction, "cart", ("time", "cart_velocity"), {"n_per_s": (0.012, 0.03)}),
    Unlisted(
        make_half_rail_friction,
        "cart",
        ("cart_position", "cart_velocity"),
        {"level_n": (0.5, 1.2), "from_m": (-0.1, 0.1)},
        shapes=("from_m",),
    ),
    Unlisted(make_fanned_cart, "cart", ("pole_rate", "cart_velocity"), {"n_s2_per_m": (0.3, 0.8)}),
    Unlisted(make_drag_chain, "cart", ("cart_position",), {"n_per_m3": (10.0, 30.0)}),
    Unlisted(
        make_hanging_cable,
        "cart",
        ("cart_position", "cart_velocity"),
        {"n_s_per_m2": (2.0, 5.0)},
        both_ways=True,
    ),
    Unlisted(
        make_bearing_notch,
        "pole",
        ("pole_angle",),
        {"torque_n_m": (0.006, 0.02), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
    Unlisted(make_air_jet, "pole", ("constant",), {"torque_n_m": (0.006, 0.02)}, both_ways=True),
    Unlisted(make_stirred_air, "pole", ("pole_rate", "cart_velocity"), {"n_s2": (0.0008, 0.0025)}),
    Unlisted(
        make_bearing_hysteresis,
        "pole",
        ("pole_angle", "pole_rate"),
        {"n_m_per_rad": (0.008, 0.02), "width_rad": (0.3, 0.6)},
        shapes=("width_rad",),
    ),
    Unlisted(
        make_kinked_tape,
        "sensor",
        ("cart_position",),
        {"per_m": (0.06, 0.15), "from_m": (-0.05, 0.05)},
        both_ways=True,
        shapes=("from_m",),
    ),
    Unlisted(
        make_clock_wander,
        "clock",
        ("time",),
        {"ratio": (0.05, 0.12), "period_s": (8.0, 20.0), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
    Unlisted(
        make_crossover_amplifier,
        "command",
        ("command",),
        {"share": (0.5, 0.8), "width": (0.1, 0.2)},
        shapes=("width",),
    ),
    Unlisted(
        make_recovering_battery,
        "command",
        ("command", "time"),
        {"share": (0.2, 0.4), "time_s": (8.0, 20.0)},
        shapes=("time_s",),
    ),
    Unlisted(
        make_outward_brake,
        "cart",
        ("cart_position", "cart_velocity"),
        {"n_s_per_m": (0.8, 2.0)},
    ),
    Unlisted(
        make_dragged_cable,
        "cart",
        ("cart_position", "cart_velocity"),
        {"n_per_m": (4.0, 10.0), "width_m": (0.04, 0.1)},
        shapes=("width_m",),
    ),
    Unlisted(make_leaning_guide, "cart", ("pole_angle", "cart_velocity"), {"level_n": (0.5, 1.2)}),
    Unlisted(
        make_draught,
        "cart",
        ("time", "frequency"),
        {"force_n": (0.08, 0.2), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
    Unlisted(
        make_pole_magnet,
        "pole",
        ("pole_angle",),
        {"torque_n_m": (0.01, 0.03), "angle_rad": (2.2, 4.0)},
        shapes=("angle_rad",),
    ),
    Unlisted(make_taut_cable, "pole", ("cart_position",), {"n_m_per_m": (0.03, 0.08)}, True),
    Unlisted(make_oily_bearing, "pole", ("pole_angle", "pole_rate"), {"n_m_s": (2.5e-3, 6e-3)}),
    Unlisted(make_bent_rack, "sensor", ("cart_position",), {"per_m": (0.08, 0.2)}, both_ways=True),
    Unlisted(
        make_wobbling_disc,
        "sensor",
        ("pole_angle",),
        {"amplitude_rad": (0.04, 0.08), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
)
BY_NAME = {entry.name: entry for entry in TABLE}


def check_parameters(name: str, parameters: Mapping[str, float]) -> dict[str, float]:
    """Return the parameters; raise BadInputError when effect or parameter does not exist."""
    if name not in BY_NAME:
        raise BadInputError(f"unlisted: unknown effect {name}; {hint_at_names(name, BY_NAME)}")
    if set(parameters) != set(BY_NAME[name].sizes):
        raise BadInputError(
            f"unlisted: {name}: expected {', '.join(BY_NAME[name].sizes)}, "
            f"found {', '.join(parameters)}"
        )
    return {key: float(value) for key, value in parameters.items()}
