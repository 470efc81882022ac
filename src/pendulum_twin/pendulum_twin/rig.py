"""The measured constants of a rig, with the units in their names."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from reprlib import repr as shown

from pendulum_twin.errors import BadInputError
from pendulum_twin.pole_body import POLE_COM_KEY, check_inertia, check_mass_matrix
from pendulum_twin.suggest import hint_at_names

CART_KEYS = ("cart_mass_kg", "force_per_pwm_n", "cart_viscous_n_s_m")
POLE_KEYS = ("pole_mass_kg", "com_distance_m", "pole_inertia_kg_m2", "pole_viscous_n_m_s")

LARGEST_PWM = 1.0  # a rig whose pwm_limit is larger has its command in another unit, such as volts
# Lowest and highest value that is believed; open at 0 where a division needs it.
RANGES: dict[str, tuple[float, float]] = {
    "cart_mass_kg": (1e-6, 1e6),
    "pole_mass_kg": (1e-6, 1e6),
    "com_distance_m": (0.0, 100.0),
    "pole_inertia_kg_m2": (1e-9, 1e6),
    "gravity_m_s2": (0.0, 100.0),
    "force_per_pwm_n": (0.0, 1e6),
    "cart_viscous_n_s_m": (0.0, 1e6),
    "pole_viscous_n_m_s": (0.0, 1e6),
    "rail_half_length_m": (1e-6, 1e3),
    "pwm_limit": (1e-6, 1e6),
}
UNITS: dict[str, str] = {
    "cart_mass_kg": "kg",
    "pole_mass_kg": "kg",
    "com_distance_m": "m",
    "pole_inertia_kg_m2": "kg m^2",
    "gravity_m_s2": "m/s^2",
    "force_per_pwm_n": "N",
    "cart_viscous_n_s_m": "N s/m",
    "pole_viscous_n_m_s": "N m s/rad",
    "rail_half_length_m": "m",
    "pwm_limit": "1",
}


@dataclass(frozen=True)
class Rig:
    """Hold the constants of a cart, a pole, or both (thesis, table 1).

    None stands for a part that the rig does not have: a cart alone has no pole keys, a pole alone
    (its cart is locked) no cart keys.

    cart_mass_kg: cart with all that moves with it along the rail.
    pole_mass_kg: pole with its weight.
    com_distance_m: l, from the axis to the centre of mass of cart and pole together.
    pole_inertia_kg_m2: Jp, of the pole about the axis of rotation.
    gravity_m_s2: g.
    force_per_pwm_n: p1, force on the cart per unit of command.
    cart_viscous_n_s_m: fc, viscous friction of the cart.
    pole_viscous_n_m_s: fp, viscous friction of the pole's bearing.
    rail_half_length_m: from the middle of the rail to either end.
    pwm_limit: largest command that the rig takes.

    Raises BadInputError for a value out of range, for a part of which only some keys are given,
    and for a mass matrix that is not positive definite (m Jp > (m l)^2, m of cart and pole): its
    energy has no lower bound, and runs end in NaN.
    """

    cart_mass_kg: float | None = None
    pole_mass_kg: float | None = None
    com_distance_m: float | None = None
    pole_inertia_kg_m2: float | None = None
    gravity_m_s2: float = 9.81
    force_per_pwm_n: float | None = None
    cart_viscous_n_s_m: float | None = None
    pole_viscous_n_m_s: float | None = None
    rail_half_length_m: float | None = None
    pwm_limit: float | None = None

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if value is not None:
                object.__setattr__(
                    self, field.name, check_number(field.name, value, *RANGES[field.name])
                )
        for joint, keys in (("cart", CART_KEYS), ("pole", POLE_KEYS)):
            missing = [k for k in keys if getattr(self, k) is None]
            if missing and len(missing) < len(keys):
                raise BadInputError(
                    f"expected all keys of the {joint} or none of them, found {missing[0]} missing"
                )
        if not (self.has_cart or self.has_pole):
            raise BadInputError(
                f"expected a cart ({', '.join(CART_KEYS)}) or a pole ({', '.join(POLE_KEYS)})"
            )
        if self.has_cart and self.has_pole:
            check_mass_matrix(self)

    @property
    def has_cart(self) -> bool:
        """Return whether the rig has a cart that moves."""
        return self.cart_mass_kg is not None

    @property
    def has_pole(self) -> bool:
        """Return whether the rig has a pole."""
        return self.pole_mass_kg is not None

    @property
    def total_mass_kg(self) -> float:
        """Return the moved mass m = cart + pole in kg."""
        return (self.cart_mass_kg or 0.0) + (self.pole_mass_kg or 0.0)

    @property
    def moment_kg_m(self) -> float:
        """Return the first moment S = m l about the axis in kg m; 0 without a pole."""
        return self.total_mass_kg * (self.com_distance_m or 0.0)

    def to_mapping(self) -> dict[str, float]:
        """Return the keys that the rig has, in the order of the twin file."""
        return {key: value for key, value in asdict(self).items() if value is not None}


def parse_rig(mapping: object) -> Rig:
    """Return the rig of a twin file's `rig` block.

    The block has the keys of `Rig`; `pole_com_distance_m` may stand for `com_distance_m`. Raises
    BadInputError naming the key that is wrong.
    """
    if not isinstance(mapping, Mapping):
        raise BadInputError(
            f"expected 'rig' to be a mapping of names to numbers, found {shown(mapping)}"
        )
    known = (*RANGES, POLE_COM_KEY)
    for key in mapping:
        if key not in known:
            raise BadInputError(describe_unknown_key("rig", str(key), known))
    if POLE_COM_KEY not in mapping:
        return Rig(**mapping)
    if "com_distance_m" in mapping:
        raise BadInputError(
            f"rig: expected com_distance_m (of cart and pole together) or {POLE_COM_KEY} "
            "(of the pole alone), found both: give one of them"
        )
    constants = {key: value for key, value in mapping.items() if key != POLE_COM_KEY}
    return Rig(**constants, com_distance_m=_compute_com_distance(mapping))


def _compute_com_distance(mapping: Mapping[str, object]) -> float:
    """Return com_distance_m of a block that gives the pole's own: the cart is on the axis."""
    distance = check_number(POLE_COM_KEY, mapping[POLE_COM_KEY], *RANGES["com_distance_m"])
    if mapping.get("pole_mass_kg") is None:
        raise BadInputError(f"{POLE_COM_KEY}: expected pole_mass_kg beside it, found it missing")
    values = {
        key: check_number(key, mapping[key], *RANGES[key])
        for key in ("pole_mass_kg", "cart_mass_kg", "pole_inertia_kg_m2")
        if mapping.get(key) is not None
    }
    pole, cart = values["pole_mass_kg"], values.get("cart_mass_kg", 0.0)
    check_inertia(values.get("pole_inertia_kg_m2", math.inf), pole, distance, has_cart=cart > 0.0)
    return pole * distance / (pole + cart)


def check_number(key: str, value: object, low: float, high: float) -> float:
    """Return value as a float; raise BadInputError when it is no finite number in [low, high]."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise BadInputError(f"{key}: expected a number, found {shown(value)}")
    # NaN is in no range; a whole number may be too large for a float
    if not low <= value <= high or abs(value) == math.inf:
        raise BadInputError(
            f"{key}: expected a number from {low:g} to {high:g}, found {shown(value)}"
        )
    return float(value)


def describe_unknown_key(where: str, key: str, known: tuple[str, ...]) -> str:
    """Return the sentence for an unknown key; it suggests the known key that is most like it."""
    similar = [name for name in known if name.split("_")[:2] == key.split("_")[:2]]
    hint = (
        f"did you mean {similar[0]} (the unit is part of the name)?"
        if similar
        else hint_at_names(key, known)
    )
    return f"{where}: unknown key {key}; {hint}"
