"""The laws of state that act on a rig beside its base model, catalogued or not."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from pendulum_bridge.emulator.friction import Law, Level, make_dry_level
from pendulum_bridge.emulator.load import add_load, change_laws, find_load
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted.extra import Extra, Gain, Pace, Shown
from pendulum_bridge.emulator.unlisted.table import BY_NAME
from pendulum_twin.rig import Rig


@dataclass(frozen=True)
class Laws:
    """Hold the laws of one rig.

    gain, push, twist, shown, pace: see `Extra`.
    dry: the cart's dry friction; see `friction.make_dry_level`.
    """

    gain: tuple[Gain, ...]
    push: tuple[Law, ...]
    twist: tuple[Law, ...]
    dry: Level | None
    shown: tuple[Shown, ...]
    pace: tuple[Pace, ...]

    @property
    def of_state(self) -> bool:
        """Return whether the forces have to be set anew in every step of the engine."""
        return bool(self.gain or self.push or self.twist or self.dry)


def collect_laws(concealed: Concealed) -> Laws:
    """Return the laws of all that is concealed and that the engine does not have itself."""
    extras, load = _make_extras(concealed), find_load(concealed)
    if load is not None:
        after = _make_extras(replace(concealed, rig=add_load(concealed.rig, load.load_kg)))
        extras = [change_laws(*pair, load.time_s) for pair in zip(extras, after, strict=True)]
    return Laws(
        gain=_drop_absent(extra.gain for extra in extras),
        push=_drop_absent(extra.push for extra in extras),
        twist=_drop_absent(extra.twist for extra in extras),
        dry=make_dry_level(concealed.effects, _drop_absent(extra.level for extra in extras)),
        shown=_drop_absent(extra.shown for extra in extras),
        pace=_drop_absent(extra.pace for extra in extras),
    )


def _drop_absent[T](laws: Iterable[T | None]) -> tuple[T, ...]:
    return tuple(law for law in laws if law is not None)


def _make_extras(concealed: Concealed) -> list[Extra]:
    return [*_make_listed(concealed), *_make_unlisted(concealed)]


def _make_listed(concealed: Concealed) -> list[Extra]:
    return [
        make(concealed.rig, **concealed.effects[name])
        for name, make in LISTED.items()
        if name in concealed.effects
    ]


def _make_unlisted(concealed: Concealed) -> list[Extra]:
    return [
        BY_NAME[name].make(concealed.rig, **values)
        for name, values in (*concealed.unlisted.items(), *concealed.rest.items())
    ]


def make_rail_tilt(rig: Rig, angle_rad: float) -> Extra:
    """Return the pull of the weight along a rail that is tilted by angle_rad.

    The pole's angle is measured from hanging, so the pole's equation stays as it is. The tilt also
    turns the cosine of the coupling by the same small angle; this second effect is left out.
    """
    share_n = rig.total_mass_kg * rig.gravity_m_s2 * math.sin(angle_rad)
    return Extra(push=lambda t, x, th, v, w: share_n)


def make_cogging(rig: Rig, amplitude_n: float, period_m: float, phase_rad: float) -> Extra:
    """Return a push on the cart that is a sine of its position."""
    return Extra(
        push=lambda t, x, th, v, w: amplitude_n * math.sin(math.tau * x / period_m + phase_rad)
    )


def make_force_ripple(rig: Rig, ratio: float, period_m: float, phase_rad: float) -> Extra:
    """Return a gain that goes up and down along the rail: a pulley that is worn."""
    return Extra(
        gain=lambda u, t, x, th, v, w: (
            u * (1 + ratio * math.sin(math.tau * x / period_m + phase_rad))
        )
    )


def make_periodic_force(
    rig: Rig, amplitude_n: float, frequency_hz: float, phase_rad: float
) -> Extra:
    """Return a push on the cart that is a sine of the time: a table that vibrates."""
    return Extra(
        push=lambda t, x, th, v, w: amplitude_n * math.sin(math.tau * frequency_hz * t + phase_rad)
    )


def make_friction_warming(
    rig: Rig, level_n: float, viscous_n_s_m: float, time_constant_s: float
) -> Extra:
    """Return friction that is less and less as time goes on: grease that warms up."""

    def get_cold_share(t: float) -> float:
        return math.exp(-t / time_constant_s)

    return Extra(
        push=lambda t, x, th, v, w: -viscous_n_s_m * get_cold_share(t) * v,
        level=lambda t, x, th, v, w: level_n * get_cold_share(t),
    )


def make_rail_drag_patch(rig: Rig, n_s_per_m: float, centre_m: float, width_m: float) -> Extra:
    """Return a brake near one place whose drag grows with the speed: magnets beside the rail."""

    def push(t: float, x: float, th: float, v: float, w: float) -> float:
        return -n_s_per_m * v / math.exp(((x - centre_m) / width_m) ** 2)

    return Extra(push=push)


def make_cart_load_friction(rig: Rig, coefficient: float) -> Extra:
    """Return dry friction by the load on the guide: the weight, less what lifts the pole.

    The pole's centre of mass goes up and down; its speed is differentiated from step to step.
    """
    moment = rig.total_mass_kg * (rig.com_distance_m or 0.0)
    rising, lifting_n, last_s = 0.0, 0.0, -1.0

    def level(t: float, x: float, th: float, v: float, w: float) -> float:
        nonlocal rising, lifting_n, last_s
        now = -moment * math.sin(th) * w
        if last_s >= 0.0 and t > last_s:
            lifting_n = (now - rising) / (t - last_s)
        rising, last_s = now, t
        return coefficient * abs(rig.total_mass_kg * rig.gravity_m_s2 + lifting_n)

    return Extra(level=level)


def make_cart_presliding_friction(rig: Rig, level_n: float, distance_m: float) -> Extra:
    """Return the push of bristles that bend by distance_m at most before they slip.

    dz = dx - |dx| z / distance_m, by the trapezoidal rule over the way of each step.
    """
    bent = 0.0
    last: float | None = None

    def push(t: float, x: float, th: float, v: float, w: float) -> float:
        nonlocal bent, last
        way = 0.0 if last is None else x - last
        half = 0.5 * abs(way) / distance_m
        bent = (bent * (1 - half) + way) / (1 + half)
        bent, last = min(max(bent, -distance_m), distance_m), x
        return -level_n * bent / distance_m

    return Extra(push=push)


def make_sample_period_error(rig: Rig, ratio: float) -> Extra:
    """Return a pace at which less time passes from sample to sample than the stamps say."""
    return Extra(pace=lambda t: 1 / (1 + ratio))


def make_motor_current_limit(rig: Rig, limit: float, counter_share: float) -> Extra:
    """Return a limit of the motor's current, which its counter voltage weakens as well.

    counter_share: of the rig's viscous friction, the counter voltage's part, which is there where
        the limit is not reached.
    """
    counter_n_s_m = counter_share * (rig.cart_viscous_n_s_m or 0.0)
    per_speed = counter_n_s_m / (rig.force_per_pwm_n or math.inf)

    def gain(u: float, t: float, x: float, th: float, v: float, w: float) -> float:
        current = u - per_speed * v
        return math.copysign(min(abs(current), limit), current) + per_speed * v

    return Extra(gain=gain)


LISTED: dict[str, Callable[..., Extra]] = {
    "rail_tilt": make_rail_tilt,
    "cogging": make_cogging,
    "force_ripple": make_force_ripple,
    "motor_current_limit": make_motor_current_limit,
    "periodic_force": make_periodic_force,
    "friction_warming": make_friction_warming,
    "rail_drag_patch": make_rail_drag_patch,
    "cart_load_friction": make_cart_load_friction,
    "cart_presliding_friction": make_cart_presliding_friction,
    "sample_period_error": make_sample_period_error,
}
