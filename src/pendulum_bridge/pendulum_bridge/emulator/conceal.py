"""What can be concealed in the emulated rig, how much of it is realistic there, and how a seed draws it.

Names and parameters are the catalogue's (they are what a verdict is compared with); the physics behind them is this
package's own: `drive.py` before the force, `mjcf.py` and `rig.py` in the mechanics, `sensors.py` behind it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pendulum_bridge.emulator.seal import Concealed
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

Span = tuple[float, float]


@dataclass(frozen=True)
class Concealable:
    """Give the realistic sizes of one effect.

    sizes: parameter name -> lowest and highest size drawn. both_ways: whether its sign is drawn too. family: of effects
    in the same family at most one is drawn, for together they mean nothing or cannot be told apart by anybody.
    """

    name: str
    family: str
    sizes: Mapping[str, Span]
    both_ways: bool = False


# Sizes for a rig of 0.7 kg, 6.4 N and a pole of 0.13 N m that swings at up to some 15 rad/s.
TABLE: tuple[Concealable, ...] = (
    Concealable("input_sign_inverted", "sign", {}),
    Concealable("input_delay", "time", {"delay_s": (0.01, 0.05)}),
    Concealable("input_dead_zone", "dead zone", {"width": (0.015, 0.06)}),
    Concealable("input_saturation", "saturation", {"limit": (0.22, 0.38)}),
    Concealable("gain_asymmetry", "asymmetry", {"ratio": (0.04, 0.2)}, both_ways=True),
    Concealable("gain_drift", "drift", {"per_s": (0.001, 0.004)}, both_ways=True),
    Concealable("motor_lag", "time", {"time_constant_s": (0.015, 0.08)}),
    Concealable("cart_coulomb_friction", "cart friction", {"level_n": (0.25, 1.2)}),
    Concealable(
        "cart_stribeck_friction",
        "cart friction",
        {"level_n": (0.25, 0.8), "static_n": (0.25, 0.8), "velocity_m_s": (0.05, 0.2)},
    ),
    Concealable("cart_quadratic_drag", "cart drag", {"n_s2_m2": (0.4, 1.6)}),
    Concealable("rail_tilt", "bias", {"angle_rad": (0.008, 0.03)}, both_ways=True),
    Concealable("rail_spring", "bias", {"n_per_m": (0.5, 2.0), "centre_m": (-0.1, 0.1)}),
    Concealable("pole_coulomb_friction", "pole friction", {"level_n_m": (0.0008, 0.004)}),
    Concealable("pole_quadratic_drag", "pole drag", {"n_m_s2": (1.5e-5, 6e-5)}),
    Concealable("pole_spring", "pole bias", {"n_m_per_rad": (0.002, 0.008)}),
    Concealable("angle_offset", "pole bias", {"angle_rad": (0.03, 0.15)}, both_ways=True),
    Concealable("cart_sign_inverted", "sign", {}),
    Concealable("angle_sign_inverted", "sign", {}),
)
BY_NAME = {each.name: each for each in TABLE}

# Base parameters whose nominal values are made wrong. The cart's mass is not: motion alone cannot tell it.
WRONG = ("cart_viscous_n_s_m", "pole_viscous_n_m_s", "force_per_pwm_n", "com_distance_m", "pole_inertia_kg_m2")
LARGEST_ERROR = 0.2


def draw(seed: int, count: int, nominal: Rig) -> Concealed:
    """Return `count` effects of realistic size, and the nominal rig with wrong parameters; the same for the same seed.

    Raises BadInputError when more effects are asked for than can be concealed together.
    """
    families = {each.family for each in TABLE}
    if not 0 <= count <= len(families):
        raise BadInputError(f"effects: expected a number from 0 to {len(families)}, found {count}")
    random = np.random.default_rng(seed)
    effects: dict[str, dict[str, float]] = {}
    taken: set[str] = set()
    for k in random.permutation(len(TABLE)):
        chosen = TABLE[k]
        if len(effects) < count and chosen.family not in taken:
            taken.add(chosen.family)
            effects[chosen.name] = _sized(chosen, random)
    return Concealed(effects, _made_wrong(nominal, random))


def _sized(chosen: Concealable, random: np.random.Generator) -> dict[str, float]:
    sign = random.choice([-1.0, 1.0]) if chosen.both_ways else 1.0
    return {name: float(sign * random.uniform(*span)) for name, span in chosen.sizes.items()}


def _made_wrong(nominal: Rig, random: np.random.Generator) -> Rig:
    factors = {name: 1 + random.uniform(-LARGEST_ERROR, LARGEST_ERROR) for name in WRONG}
    return replace(nominal, **{name: float(getattr(nominal, name) * factor) for name, factor in factors.items()})
