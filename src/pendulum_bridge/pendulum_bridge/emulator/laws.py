"""What acts on a rig beside its base model, as laws of its state; the rig applies them, catalogued or not."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

from pendulum_bridge.emulator.friction import Law, Level, make_dry_level
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted import BY_NAME, Extra, Gain, Pace, Shown
from pendulum_twin.rig import Rig


@dataclass(frozen=True)
class Laws:
    """Hold the laws of one rig; see `Extra` for what they are of, and `friction.dry_level` for dry."""

    gain: tuple[Gain, ...]
    push: tuple[Law, ...]
    twist: tuple[Law, ...]
    dry: Level | None
    shown: tuple[Shown, ...]
    pace: tuple[Pace, ...]

    @property
    def of_state(self) -> bool:
        """Tell whether forces have to be set anew in every step of the engine."""
        return bool(self.gain or self.push or self.twist or self.dry)


def collect_laws(concealed: Concealed) -> Laws:
    """Return the laws of everything that is concealed and that the engine does not have by itself."""
    extras = [*_make_listed(concealed), *_make_unlisted(concealed)]
    return Laws(
        gain=_drop_absent(each.gain for each in extras),
        push=_drop_absent(each.push for each in extras),
        twist=_drop_absent(each.twist for each in extras),
        dry=make_dry_level(concealed.effects, _drop_absent(each.level for each in extras)),
        shown=_drop_absent(each.shown for each in extras),
        pace=_drop_absent(each.pace for each in extras),
    )


def _drop_absent[T](laws: Iterable[T | None]) -> tuple[T, ...]:
    return tuple(law for law in laws if law is not None)


def _make_listed(concealed: Concealed) -> list[Extra]:
    return [
        make(concealed.rig, **concealed.effects[name])
        for name, make in LISTED.items()
        if name in concealed.effects
    ]


def _make_unlisted(concealed: Concealed) -> list[Extra]:
    return [
        BY_NAME[name].make(concealed.rig, **values) for name, values in concealed.unlisted.items()
    ]


def make_rail_tilt(rig: Rig, angle_rad: float) -> Extra:
    """Pull the cart with the weight's share along the rail.

    The pole's angle is measured from hanging, whatever the tilt, so the pole's own weight keeps
    its equation; the tilt's second effect, the coupling's cosine turned by the same small angle,
    is left out.
    """
    share_n = rig.total_mass_kg * rig.gravity_m_s2 * math.sin(angle_rad)
    return Extra(push=lambda t, x, th, v, w: share_n)


def make_cogging(rig: Rig, amplitude_n: float, period_m: float, phase_rad: float) -> Extra:
    """Push the cart with a sine of its position."""
    return Extra(
        push=lambda t, x, th, v, w: amplitude_n * math.sin(math.tau * x / period_m + phase_rad)
    )


def make_sample_period_error(rig: Rig, ratio: float) -> Extra:
    """Let less time pass from sample to sample than the stamps say."""
    return Extra(pace=lambda t: 1 / (1 + ratio))


LISTED: dict[str, Callable[..., Extra]] = {
    "rail_tilt": make_rail_tilt,
    "cogging": make_cogging,
    "sample_period_error": make_sample_period_error,
}
