"""Physics that the catalogue does not hold: a diagnosis must not give it a catalogue name.

Each entry names the place of the chain where it acts and the variables on which the missing force
(torque, sensor error) depends; its law is a closure that the emulated rig applies. Sizes are for a
rig of 0.7 kg, 6.4 N and a pole of 0.13 N m.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.emulator.friction import Law
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig
from pendulum_twin.suggest import hint_at_names

Span = tuple[float, float]
# From the command and t, x, th, v, w to the command that acts.
Gain = Callable[[float, float, float, float, float, float], float]
# From t, x, th to position and angle as the sensors see them.
Shown = Callable[[float, float, float], tuple[float, float]]
# From the time by the stamps to true seconds a stamped second.
Pace = Callable[[float], float]


@dataclass(frozen=True)
class Extra:
    """Hold the laws that one piece of physics adds; None for a law that it leaves alone.

    All are laws of the true t (s), x (m), th (rad, 0 upright), v (m/s), w (rad/s).
    gain: command that acts, PWM fraction.
    push: force on the cart along the rail, N.
    twist: torque on the pole, N m.
    level: the cart's dry friction, N.
    shown: position (m) and angle (rad) that the sensors see.
    pace: true seconds a stamped second.
    """

    gain: Gain | None = None
    push: Law | None = None
    twist: Law | None = None
    level: Law | None = None
    shown: Shown | None = None
    pace: Pace | None = None


def make_gain_along_rail(rig: Rig, per_m: float) -> Extra:
    """Change the gain along the rail: a belt that is tighter at one end."""
    return Extra(gain=lambda u, t, x, th, v, w: u * (1 + per_m * x))


def make_gain_falling_with_speed(rig: Rig, s_per_m: float) -> Extra:
    """Take force away in proportion to command and speed: a weak supply."""
    return Extra(gain=lambda u, t, x, th, v, w: u * max(1 - s_per_m * abs(v), 0.0))


def make_supply_ripple(rig: Rig, ratio: float, frequency_hz: float, phase_rad: float) -> Extra:
    """Let the gain go slowly up and down in time."""
    return Extra(
        gain=lambda u, t, x, th, v, w: (
            u * (1 + ratio * math.sin(math.tau * frequency_hz * t + phase_rad))
        )
    )


def make_warming_friction(rig: Rig, n_per_s: float) -> Extra:
    """Let the cart's dry friction grow with time from nothing."""
    return Extra(level=lambda t, x, th, v, w: n_per_s * t)


def make_half_rail_friction(rig: Rig, level_n: float, from_m: float) -> Extra:
    """Add dry friction on one part of the rail only, with a sharp edge."""
    return Extra(level=lambda t, x, th, v, w: level_n if x > from_m else 0.0)


def make_load_friction(rig: Rig, share: float) -> Extra:
    """Add dry friction in proportion to the pole's centrifugal force on its bearing."""
    moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
    return Extra(level=lambda t, x, th, v, w: share * moment * w * w)


def make_drag_chain(rig: Rig, n_per_m3: float) -> Extra:
    """Pull the cart back with the cube of its distance from the middle."""
    return Extra(push=lambda t, x, th, v, w: -n_per_m3 * x**3)


def make_hanging_cable(rig: Rig, n_s_per_m2: float) -> Extra:
    """Brake the cart in proportion to speed and position, so drive it on the other side."""
    return Extra(push=lambda t, x, th, v, w: -n_s_per_m2 * x * v)


def make_bearing_notch(rig: Rig, torque_n_m: float, phase_rad: float) -> Extra:
    """Turn the pole towards three places of its bearing."""
    return Extra(twist=lambda t, x, th, v, w: torque_n_m * math.sin(3 * th + phase_rad))


def make_air_jet(rig: Rig, torque_n_m: float) -> Extra:
    """Turn the pole with a constant torque."""
    return Extra(twist=lambda t, x, th, v, w: torque_n_m)


def make_stirred_air(rig: Rig, n_s2: float) -> Extra:
    """Brake the pole in proportion to its rate and to the cart's speed."""
    return Extra(twist=lambda t, x, th, v, w: -n_s2 * abs(v) * w)


def make_bearing_hysteresis(rig: Rig, n_m_per_rad: float, width_rad: float) -> Extra:
    """Turn the pole back with a spring whose other end is dragged along width behind."""
    end: float | None = None

    def twist(t: float, x: float, th: float, v: float, w: float) -> float:
        nonlocal end
        end = th if end is None else min(max(end, th - width_rad), th + width_rad)
        return n_m_per_rad * (end - th)

    return Extra(twist=twist)


def make_pulley_runout(rig: Rig, amplitude_m: float, period_m: float, phase_rad: float) -> Extra:
    """Show a position that runs ahead and behind along the rail."""
    return Extra(
        shown=lambda t, x, th: (
            x + amplitude_m * math.sin(math.tau * x / period_m + phase_rad),
            th,
        )
    )


def make_clock_wander(rig: Rig, ratio: float, period_s: float, phase_rad: float) -> Extra:
    """Let the time between samples go slowly up and down while the stamps say that it does not."""
    return Extra(pace=lambda t: 1 + ratio * math.sin(math.tau * t / period_s + phase_rad))


def make_stepped_amplifier(rig: Rig, step: float) -> Extra:
    """Round the command to the nearest step."""
    return Extra(gain=lambda u, t, x, th, v, w: step * round(u / step) if step else u)


def make_recovering_battery(rig: Rig, share: float, time_s: float) -> Extra:
    """Let the gain begin too small by a share, and recover."""
    return Extra(gain=lambda u, t, x, th, v, w: u * (1 - share * math.exp(-t / time_s)))


def make_magnetic_brake(rig: Rig, n_s_per_m: float, centre_m: float, width_m: float) -> Extra:
    """Brake the cart in proportion to its speed near one place: an eddy brake."""
    return Extra(
        push=lambda t, x, th, v, w: -n_s_per_m * math.exp(-(((x - centre_m) / width_m) ** 2)) * v
    )


def make_dragged_cable(rig: Rig, n_per_m: float, width_m: float) -> Extra:
    """Pull the cart back with a spring whose other end is dragged along width behind."""
    end: float | None = None

    def push(t: float, x: float, th: float, v: float, w: float) -> float:
        nonlocal end
        end = x if end is None else min(max(end, x - width_m), x + width_m)
        return n_per_m * (end - x)

    return Extra(push=push)


def make_leaning_guide(rig: Rig, level_n: float) -> Extra:
    """Add dry friction of the cart that is largest while the pole is level."""
    return Extra(level=lambda t, x, th, v, w: level_n * math.sin(th) ** 2)


def make_draught(rig: Rig, force_n: float, phase_rad: float) -> Extra:
    """Push the cart at random: a wind of many slow waves that never repeats."""
    random = random_waves(phase_rad)
    return Extra(
        push=lambda t, x, th, v, w: (
            force_n * sum(math.sin(math.tau * hertz * t + phase) for hertz, phase in random)
        )
    )


def random_waves(seed: float) -> list[tuple[float, float]]:
    """Return frequencies, Hz, and phases, rad, of 12 waves that a number stands for."""
    numbers = np.random.default_rng(int(1e6 * (seed + 10.0)))
    return [
        (float(hertz), float(phase))
        for hertz, phase in zip(
            numbers.uniform(0.1, 2.0, 12), numbers.uniform(0.0, math.tau, 12), strict=True
        )
    ]


def make_pole_magnet(rig: Rig, torque_n_m: float, angle_rad: float) -> Extra:
    """Turn the pole towards one angle when it is near."""

    def twist(t: float, x: float, th: float, v: float, w: float) -> float:
        away = math.remainder(th - angle_rad, math.tau) / 0.5
        return -torque_n_m * away * math.exp(-away * away)

    return Extra(twist=twist)


def make_oily_bearing(rig: Rig, n_m_s: float) -> Extra:
    """Brake the pole in proportion to its rate, most above the cart and not at all below."""
    return Extra(twist=lambda t, x, th, v, w: -n_m_s * (1 + math.cos(th)) * w)


def make_bent_rack(rig: Rig, per_m: float) -> Extra:
    """Show a position that is off by the square of the position."""
    return Extra(shown=lambda t, x, th: (x + per_m * x * abs(x), th))


def make_wobbling_disc(rig: Rig, amplitude_rad: float, phase_rad: float) -> Extra:
    """Show an angle that runs ahead and behind twice a turn."""
    return Extra(shown=lambda t, x, th: (x, th + amplitude_rad * math.sin(2 * th + phase_rad)))


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
    Unlisted(make_load_friction, "cart", ("pole_rate", "cart_velocity"), {"share": (0.5, 1.2)}),
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
        make_pulley_runout,
        "sensor",
        ("cart_position",),
        {"amplitude_m": (0.003, 0.008), "period_m": (0.15, 0.3), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
    Unlisted(
        make_clock_wander,
        "clock",
        ("time",),
        {"ratio": (0.05, 0.12), "period_s": (8.0, 20.0), **PHASE_SIZES},
        shapes=WAVE_SHAPES,
    ),
    Unlisted(make_stepped_amplifier, "command", ("command",), {"step": (0.04, 0.08)}),
    Unlisted(
        make_recovering_battery,
        "command",
        ("command", "time"),
        {"share": (0.2, 0.4), "time_s": (8.0, 20.0)},
        shapes=("time_s",),
    ),
    Unlisted(
        make_magnetic_brake,
        "cart",
        ("cart_position", "cart_velocity"),
        {"n_s_per_m": (3.0, 8.0), "centre_m": (-0.1, 0.1), "width_m": (0.05, 0.12)},
        shapes=("centre_m", "width_m"),
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
