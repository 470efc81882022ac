"""The rig's own swing-down: bring the cart to rest in the middle and the pole to rest hanging.

It belongs to the rig: it reads the true state, before the sensors, and knows the rig's constants,
as the maker who tuned it does. The cart follows a velocity k sin(ph) - c x, where ph is the pole's
angle from hanging. The first term takes k (m l) w^2 cos(ph)^2 of the pole's energy a second; the
second leads to the middle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum

from pendulum_twin.arrays import Floats
from pendulum_twin.rig import Rig

POLE_DAMPING = 0.25  # of the hanging pole's oscillation, as a share of critical
CENTRING_PER_S = 1.0
VELOCITY_LOOP_PER_S = 6.0
INTEGRAL_PER_S2 = 6.0
LARGEST_STUCK_RAD = 0.2
LARGEST_INTEGRAL_M_S2 = 2.0  # m/s^2: tilt and spring need less
HOLDING_FRICTIONS = (  # effect and parameter of the friction that holds a cart at rest
    ("cart_coulomb_friction", "level_n"),
    ("cart_stribeck_friction", "level_n"),
    ("cart_stribeck_friction", "static_n"),
    ("cart_saturating_friction", "level_n"),
    ("cart_presliding_friction", "level_n"),
)
SIGN_WIDTH_M_S = 0.01  # wanted velocity over which the command against friction changes sign


class Phase(Enum):
    """The states of a swing-down; the value is a sentence."""

    RUNNING = "the pendulum is brought to rest"
    AT_REST = "the pendulum hangs at rest in the middle of the rail"
    GAVE_UP = "the pendulum did not come to rest in time"


@dataclass(frozen=True)
class Rest:
    """Hold the limits within which cart and pole are at rest.

    cart_m, cart_m_s: distance from the middle, and speed.
    pole_rad, pole_rad_s: angle from hanging, in any turn, and rate.
    samples: samples at rest in a row.
    limit_s: time after which the swing-down gives up.
    """

    cart_m: float = 0.01
    cart_m_s: float = 0.02
    pole_rad: float = 0.02
    pole_rad_s: float = 0.1
    samples: int = 20
    limit_s: float = 30.0


@dataclass(frozen=True)
class Tuning:
    """Hold the controller's constants, all in SI units.

    per_m_s2: command for an acceleration of 1 m/s^2.
    viscous_per_s: deceleration of the cart per unit of its speed.
    follow_m_s: the gain k.
    breakaway: command that just overcomes dead zone and dry friction.
    way: -1 when the drive is wired the wrong way round, else 1.
    limit: largest command.
    turn_rad: from one resting angle to the next; less than a turn where a spring winds up.
    stuck_rad: distance from the resting angle at which the pole's dry friction can hold it.
    """

    per_m_s2: float
    viscous_per_s: float
    follow_m_s: float
    breakaway: float
    way: int
    limit: float
    turn_rad: float
    stuck_rad: float


@dataclass(frozen=True)
class SwingDown:
    """Hold the progress of a swing-down.

    elapsed_s: since its start.
    still: samples at rest in a row.
    integral: of the velocity loop, m/s^2.
    """

    phase: Phase = Phase.RUNNING
    elapsed_s: float = 0.0
    still: int = 0
    integral: float = 0.0


def make_tuning(rig: Rig, effects: Mapping[str, Mapping[str, float]]) -> Tuning:
    """Return the tuning for a rig; a rig without gravity or lever gets no damping of the pole."""
    force, mass = rig.force_per_pwm_n or 1.0, rig.total_mass_kg
    lever, inertia = mass * (rig.com_distance_m or 0.0), rig.pole_inertia_kg_m2 or 1.0
    weight = lever * rig.gravity_m_s2  # N m a rad from hanging
    twist = effects.get("pole_spring", {}).get("n_m_per_rad", 0.0)
    sticking = effects.get("pole_coulomb_friction", {}).get("level_n_m", 0.0)
    dry = sum(effects.get(name, {}).get(key, 0.0) for name, key in HOLDING_FRICTIONS)
    by_load = effects.get("cart_load_friction", {}).get("coefficient", 0.0)
    dry += by_load * rig.total_mass_kg * rig.gravity_m_s2
    return Tuning(
        per_m_s2=mass / force,
        viscous_per_s=(rig.cart_viscous_n_s_m or 0.0) / mass,
        follow_m_s=2 * POLE_DAMPING * math.sqrt(weight * inertia) / lever if lever else 0.0,
        breakaway=effects.get("input_dead_zone", {}).get("width", 0.0) + dry / force,
        way=-1 if "input_sign_inverted" in effects else 1,
        limit=rig.pwm_limit or math.inf,
        turn_rad=math.tau * weight / (weight + twist) if weight else math.tau,
        stuck_rad=min(sticking / weight, LARGEST_STUCK_RAD) if weight else LARGEST_STUCK_RAD,
    )


def advance(
    now: SwingDown, state: Floats, tuning: Tuning, period_s: float, limits: Rest = Rest()
) -> tuple[SwingDown, float]:
    """Return the next progress and the command (PWM fraction) to hold for one sample period.

    The command is 0 once the swing-down is over.
    state: (4,) true x (m, 0 in the middle), th (rad, 0 upright), v (m/s), w (rad/s).
    """
    if now.phase is not Phase.RUNNING:
        return now, 0.0
    still = now.still + 1 if is_at_rest(state, tuning, limits) else 0
    if still >= limits.samples:
        return replace(now, phase=Phase.AT_REST, still=still), 0.0
    if now.elapsed_s >= limits.limit_s:
        return replace(now, phase=Phase.GAVE_UP, still=still), 0.0
    integral, command = _compute_command(now.integral, state, tuning, period_s)
    return SwingDown(Phase.RUNNING, now.elapsed_s + period_s, still, integral), command


def is_at_rest(state: Floats, tuning: Tuning, limits: Rest = Rest()) -> bool:
    """Return whether the cart stands in the middle and the pole hangs, within `limits`."""
    x, angle, v, w = _measure_from_hanging(state, tuning)
    near = abs(x) <= limits.cart_m and abs(angle) <= limits.pole_rad
    return near and abs(v) <= limits.cart_m_s and abs(w) <= limits.pole_rad_s


def _compute_command(
    integral: float, state: Floats, tuning: Tuning, period_s: float
) -> tuple[float, float]:
    x, angle, v, w = _measure_from_hanging(state, tuning)
    wanted = tuning.follow_m_s * math.sin(angle) - CENTRING_PER_S * x
    wanted_per_s = tuning.follow_m_s * math.cos(angle) * w - CENTRING_PER_S * v
    integral += INTEGRAL_PER_S2 * (wanted - v) * period_s
    integral = min(max(integral, -LARGEST_INTEGRAL_M_S2), LARGEST_INTEGRAL_M_S2)
    acceleration = (
        wanted_per_s + VELOCITY_LOOP_PER_S * (wanted - v) + integral + tuning.viscous_per_s * v
    )
    command = tuning.per_m_s2 * acceleration + tuning.breakaway * math.tanh(
        wanted / SIGN_WIDTH_M_S
    )
    return integral, tuning.way * min(max(command, -tuning.limit), tuning.limit)


def _measure_from_hanging(state: Floats, tuning: Tuning) -> tuple[float, float, float, float]:
    """Return x, angle from hanging, v, w; the angle is 0 where dry friction can hold the pole."""
    x, th, v, w = (float(value) for value in state)
    angle = math.remainder(th - math.pi, tuning.turn_rad)
    return x, math.copysign(max(abs(angle) - tuning.stuck_rad, 0.0), angle), v, w
