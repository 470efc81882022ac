"""What can be concealed in the emulated rig, how much of it is realistic there, and how a seed draws it.

Names and parameters are the catalogue's (they are what a verdict is compared with); the physics
behind them is this package's own: `drive.py` before the force, `mjcf.py`, `friction.py` and
`laws.py` in the mechanics, `sensors.py` behind it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted import BY_NAME as UNLISTED
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

Span = tuple[float, float]


@dataclass(frozen=True)
class Concealable:
    """Give the realistic sizes of one effect.

    sizes: parameter name -> lowest and highest size drawn. both_ways: whether the sign of its size
    is drawn too. family: of effects in the same family at most one is drawn, for together they
    mean nothing or cannot be told apart by anybody.
    shapes: parameters that say where or how rather than how much: neither sign nor size factor is
    theirs. neutral: the size at which the effect vanishes. beside: effects of which one must be
    there, for this one to mean anything. live:
    whether a rig that is driven from outside can have it: one that counts from a recording's
    beginning cannot be.
    """

    name: str
    family: str
    sizes: Mapping[str, Span]
    both_ways: bool = False
    shapes: tuple[str, ...] = ()
    neutral: float = 0.0
    beside: tuple[str, ...] = ()
    live: bool = True


DRY_FRICTIONS = ("cart_coulomb_friction", "cart_stribeck_friction", "cart_saturating_friction")
ANGLE_SIZES_RAD = (0.03, 0.15)  # rad

# Sizes for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m that swings at up to some 15 rad/s.
TABLE: tuple[Concealable, ...] = (
    Concealable("input_sign_inverted", "sign", {}),
    Concealable("input_delay", "time", {"delay_s": (0.01, 0.05)}),
    Concealable("input_dead_zone", "dead zone", {"width": (0.015, 0.06)}),
    Concealable("input_saturation", "saturation", {"limit": (0.22, 0.38)}, neutral=0.5),
    Concealable("gain_asymmetry", "asymmetry", {"ratio": (0.04, 0.2)}, both_ways=True),
    Concealable("gain_drift", "drift", {"per_s": (0.001, 0.004)}, both_ways=True),
    Concealable("motor_lag", "time", {"time_constant_s": (0.015, 0.08)}),
    Concealable("belt_backlash", "slack", {"gap_m": (0.0015, 0.008)}),
    Concealable("cart_coulomb_friction", "cart friction", {"level_n": (0.25, 1.2)}),
    Concealable(
        "cart_stribeck_friction",
        "cart friction",
        {"level_n": (0.25, 0.8), "static_n": (0.25, 0.8), "velocity_m_s": (0.05, 0.2)},
        shapes=("velocity_m_s",),
    ),
    Concealable(
        "cart_saturating_friction",
        "cart friction",
        {"viscous_n_s_m": (1.0, 4.0), "level_n": (0.15, 0.4), "limit_n": (0.7, 1.1)},
    ),
    Concealable(
        "cart_friction_asymmetry",
        "friction asymmetry",
        {"ratio": (0.15, 0.4)},
        both_ways=True,
        beside=DRY_FRICTIONS,
    ),
    Concealable("cart_quadratic_drag", "cart drag", {"n_s2_m2": (0.4, 1.6)}),
    Concealable("rail_tilt", "bias", {"angle_rad": (0.008, 0.03)}, both_ways=True),
    Concealable(
        "rail_spring",
        "bias",
        {"n_per_m": (0.5, 2.0), "centre_m": (-0.1, 0.1)},
        shapes=("centre_m",),
    ),
    Concealable(
        "rail_friction_patch",
        "friction patch",
        {"level_n": (0.5, 1.5), "centre_m": (-0.2, 0.2), "width_m": (0.05, 0.15)},
        shapes=("centre_m", "width_m"),
    ),
    Concealable(
        "cogging",
        "cogging",
        {"amplitude_n": (0.2, 0.6), "period_m": (0.03, 0.15), "phase_rad": (-3.0, 3.0)},
        shapes=("period_m", "phase_rad"),
    ),
    Concealable("pole_coulomb_friction", "pole friction", {"level_n_m": (0.0008, 0.004)}),
    Concealable("pole_quadratic_drag", "pole drag", {"n_m_s2": (1.5e-5, 6e-5)}),
    Concealable("pole_spring", "pole bias", {"n_m_per_rad": (0.002, 0.008)}),
    Concealable("pole_imbalance", "pole bias", {"angle_rad": ANGLE_SIZES_RAD}, both_ways=True),
    Concealable("angle_offset", "pole bias", {"angle_rad": ANGLE_SIZES_RAD}, both_ways=True),
    Concealable(
        "encoder_slip",
        "slip",
        {"angle_rad": ANGLE_SIZES_RAD, "time_s": (12.0, 35.0)},
        both_ways=True,
        shapes=("time_s",),
        live=False,
    ),
    Concealable("sensor_delay", "time", {"delay_s": (0.01, 0.05)}),
    Concealable("angle_scale", "angle scale", {"ratio": (0.02, 0.08)}, both_ways=True),
    Concealable("position_scale", "pace", {"ratio": (0.03, 0.1)}, both_ways=True),
    Concealable("cart_sign_inverted", "sign", {}),
    Concealable("angle_sign_inverted", "sign", {}),
    Concealable("velocity_filter", "velocities", {"time_constant_s": (0.02, 0.08)}),
    Concealable("sample_period_error", "pace", {"ratio": (0.02, 0.06)}, both_ways=True),
    Concealable("stale_start", "beginning", {"seconds": (0.5, 2.0)}, live=False),
)
BY_NAME = {each.name: each for each in TABLE}

# Base parameters whose nominal values are made wrong. The cart's mass is not: motion alone cannot
# tell it.
PERTURBED_CONSTANTS = (
    "cart_viscous_n_s_m",
    "pole_viscous_n_m_s",
    "force_per_pwm_n",
    "com_distance_m",
    "pole_inertia_kg_m2",
)
LARGEST_PERTURBATION = 0.2


def draw_concealed(seed: int, count: int, nominal: Rig, live: bool = False) -> Concealed:
    """Return `count` effects of realistic size, and the nominal rig with wrong parameters; the same for the same seed.

    live: only effects that a rig driven from outside can have. Raises BadInputError when more
    effects are asked for than can be concealed together.
    """
    return conceal_effects(complete_set((), count, seed, live), seed, nominal)


def complete_set(
    names: Sequence[str], count: int, seed: int, live: bool = False
) -> tuple[str, ...]:
    """Return these effects and as many more, drawn by the seed, as make `count` that go together."""
    families = {each.family for each in TABLE if each.live or not live}
    if not 0 <= count <= len(families):
        raise BadInputError(f"effects: expected a number from 0 to {len(families)}, found {count}")
    random = np.random.default_rng(seed)
    chosen = [BY_NAME[name] for name in names]
    order = [TABLE[k] for k in random.permutation(len(TABLE)) if TABLE[k].live or not live]
    while len(chosen) < count:
        chosen.append(next(each for each in order if _is_compatible(each, chosen, count)))
    return tuple(each.name for each in chosen)


def _is_compatible(candidate: Concealable, chosen: Sequence[Concealable], count: int) -> bool:
    """Tell whether one more effect leaves every effect with what it must have beside it, or with room for it."""
    names = {each.name for each in chosen}
    lacking = next(
        (each.beside for each in chosen if each.beside and not names & set(each.beside)), ()
    )
    if candidate.family in {each.family for each in chosen} or (
        lacking and candidate.name not in lacking
    ):
        return False
    return not candidate.beside or bool(names & set(candidate.beside)) or len(chosen) + 2 <= count


def conceal_effects(
    names: Sequence[str], seed: int, nominal: Rig, size_factor: float = 1.0
) -> Concealed:
    """Return these effects with sizes drawn by the seed times size_factor, and the nominal rig with wrong parameters.

    names: of this table, or of unlisted effects. The constants are the same whatever is concealed.
    """
    listed, unlisted = (
        {
            name: draw_sizes(table[name], np.random.default_rng([seed, 1, k]), size_factor)
            for k, name in enumerate(names)
            if name in table
        }
        for table in (BY_NAME, UNLISTED)
    )
    return Concealed(listed, _perturb_rig(nominal, np.random.default_rng([seed, 0])), unlisted)


class Sized(Protocol):
    """What has sizes to be drawn: see `Concealable`."""

    @property
    def sizes(self) -> Mapping[str, Span]:
        """Return parameter -> lowest and highest."""

    @property
    def both_ways(self) -> bool:
        """Tell whether signs are drawn."""

    @property
    def shapes(self) -> tuple[str, ...]:
        """Return the parameters that are no sizes."""

    @property
    def neutral(self) -> float:
        """Return the size of nothing."""


def draw_sizes(chosen: Sized, random: np.random.Generator, factor: float) -> dict[str, float]:
    """Return drawn parameters; the distance of a size from neutral is multiplied by the factor."""
    sign = random.choice([-1.0, 1.0]) if chosen.both_ways else 1.0
    drawn = {name: float(random.uniform(*span)) for name, span in chosen.sizes.items()}
    grown = {
        name: chosen.neutral + factor * (sign * value - chosen.neutral)
        for name, value in drawn.items()
    }
    return {name: drawn[name] if name in chosen.shapes else grown[name] for name in drawn}


def _perturb_rig(nominal: Rig, random: np.random.Generator) -> Rig:
    factors = {
        name: 1 + random.uniform(-LARGEST_PERTURBATION, LARGEST_PERTURBATION)
        for name in PERTURBED_CONSTANTS
    }
    return replace(
        nominal,
        **{name: float(getattr(nominal, name) * factor) for name, factor in factors.items()},
    )
