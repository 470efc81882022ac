"""The free parameters of a fit: the rig's constants that motion fixes, and those of effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.smooth_state import SmoothState
from pendulum_sysid.errors import WrongUse
from pendulum_sysid.records import Estimate
from pendulum_twin.arrays import Floats, Mask
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Effect, Parameter, Scale
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import (
    CART_VISCOUS,
    COUPLING,
    FORCE_PER_PWM,
    INERTIA,
    MASS,
    MOMENT,
    POLE_VISCOUS,
    SLOTS,
    get_laws,
    make_theta,
)
from pendulum_twin.pole_body import LEAST_INERTIA_SHARE_ALONE, move_mass_to_pole
from pendulum_twin.rig import RANGES, UNITS, Rig
from pendulum_twin.signals import Signals
from pendulum_twin.suggest import add_hint

ALL = "all"  # stands for every constant
MOST_COUPLING_SHARE = 0.9999  # of sqrt(mass * inertia), where the mass matrix becomes singular
Scales = dict[Scale, float]


JUMPS = {  # share of its value to which a fit tells a parameter, for runs jump with it
    f"{e.name}.{p.name}": p.jumps for e in CATALOGUE for p in e.parameters if p.jumps
}


@dataclass(frozen=True)
class Free:
    """Describe a free parameter of a fit.

    name, unit: in verdicts.
    theta, factors: entries of theta that it sets, each to factor * value.
    low, high: range, in the unit.
    size: a typical magnitude, by which a fit scales its steps, in the unit.
    offset: what is added to factor * value, in the unit of theta's entry.
    believed, spread: mean and standard deviation of what is believed of the value beforehand;
        infinite spread for a value that is a mere guess.
    acts: (samples,) where the value may act; runs that keep away from there do not depend on it.
        None for everywhere.
    """

    name: str
    unit: str
    theta: tuple[int, ...]
    factors: tuple[float, ...]
    low: float
    high: float
    size: float
    offset: float = 0.0
    believed: float = 0.0
    spread: float = np.inf
    acts: Mask | None = field(default=None, compare=False, repr=False)

    @property
    def belief(self) -> float:
        """Return the weight of what is believed beforehand, by the parameter's size."""
        return (self.size / self.spread) ** 2

    def compute_pull(self, theta: Floats) -> float:
        """Return how many sizes the belief lies above the value that theta (SIZE,) holds."""
        return (self.believed - self.get(theta)) / self.size if np.isfinite(self.spread) else 0.0

    def get(self, theta: Floats) -> float:
        """Return the value that theta (SIZE,) holds."""
        return float((theta[self.theta[0]] - self.offset) / self.factors[0])

    def put(self, theta: Floats, value: float | Floats) -> None:
        """Set the value in theta (..., SIZE)."""
        for slot, factor in zip(self.theta, self.factors, strict=True):
            theta[..., slot] = factor * value + self.offset


def make_estimate(parameter: Free, value: float, half: float) -> Estimate:
    """Return the estimate of a parameter, its 95 % interval within the parameter's range.

    value: where the fit ended, in the unit.
    half: half width of the interval, in the unit; not finite where nothing fixes the parameter.
    """
    half = half if np.isfinite(half) else np.inf
    bound = value <= parameter.low or value >= parameter.high
    fixed = half < max(abs(value), parameter.size) and not bound
    low, high = max(value - half, parameter.low), min(value + half, parameter.high)
    return Estimate(value, low, high, fixed, bound)


def list_rig_parameters(twin: Twin) -> tuple[Free, ...]:
    """Return the rig's constants that motion can fix, without those that are known.

    Motion fixes only ratios: the cart's mass stays as measured, and for a pole alone its inertia
    does, unless the twin says how well the cart's mass is known. The distance of a pole alone
    stays within what a twin file may hold. The common distance stands for the moment of the pole's
    weight: its value is that of the twin's masses.
    """
    rig, theta = twin.rig, make_theta(twin)
    constants = _list_cart_constants(twin, theta) if rig.has_cart else []
    if rig.has_pole:
        constants += _list_pole_constants(rig, theta)
    return tuple(
        replace(c, believed=float(getattr(rig, c.name)), spread=twin.spreads.get(c.name, np.inf))
        for c in constants
        if twin.spreads.get(c.name) != 0.0
    )


def _list_cart_constants(twin: Twin, theta: Floats) -> list[Free]:
    """Return the constants of drive and cart; the mass only where its spread is given."""
    force = theta[FORCE_PER_PWM] or 1.0
    viscous = max(theta[CART_VISCOUS], 0.1 * theta[MASS])
    constants = [
        _make_constant("force_per_pwm_n", (FORCE_PER_PWM,), force),
        _make_constant("cart_viscous_n_s_m", (CART_VISCOUS,), viscous),
    ]
    if twin.spreads.get("cart_mass_kg"):
        mass = _make_constant("cart_mass_kg", (MASS,), twin.rig.cart_mass_kg or 1.0)
        constants.append(replace(mass, offset=twin.rig.pole_mass_kg or 0.0))
    return constants


def _list_pole_constants(rig: Rig, theta: Floats) -> list[Free]:
    """Return the constants of the pole: distance, inertia beside a cart, and viscous friction."""
    mass, reach = rig.total_mass_kg, decisions.POLE_CONSTANT_RATIO
    size = rig.com_distance_m or 0.1
    distance = _make_constant("com_distance_m", (MOMENT, COUPLING), size, mass, reach)
    viscous = max(theta[POLE_VISCOUS], 0.01 * theta[INERTIA])
    friction = _make_constant("pole_viscous_n_m_s", (POLE_VISCOUS,), viscous)
    if rig.has_cart:
        inertia = _make_constant("pole_inertia_kg_m2", (INERTIA,), theta[INERTIA], 1.0, reach)
        return [distance, inertia, friction]
    farthest = np.sqrt(theta[INERTIA] / (LEAST_INERTIA_SHARE_ALONE * mass))
    high = min(distance.high, max(float(farthest), distance.size))
    return [replace(distance, high=high), friction]


def _make_constant(
    name: str, slots: tuple[int, ...], size: float, factor: float = 1.0, reach: float = np.inf
) -> Free:
    """Return a constant of the rig.

    slots: entries of theta that it sets, each to factor times the value.
    size: a typical magnitude, in the constant's unit.
    reach: ratio to size, up or down, beyond which no fit goes.
    """
    low, high = RANGES[name]
    low, high = max(low, size / reach), min(high, size * reach)
    return Free(name, UNITS[name], slots, (factor,) * len(slots), low, high, size)


def hold_constants(twin: Twin, names: str | Sequence[str]) -> Twin:
    """Return the twin with constants that are known, so that no fit changes them.

    names: of constants, a text for a single constant; "all" stands for every constant that a fit
        changes.

    Raises WrongUse for a name that is no constant of the rig that a fit changes.
    """
    names = [names] if isinstance(names, str) else names
    constants = [constant.name for constant in list_rig_parameters(twin)]
    for name in names:
        if name not in (*constants, ALL):
            raise WrongUse(
                f"hold: expected constants that a fit changes ({', '.join(constants)}) or {ALL}, "
                f"found {name!r}{add_hint(name, constants)}"
            )
    return twin.hold(constants if ALL in names else names)


def keep_definite(theta: Floats) -> Floats:
    """Return theta (SIZE,) with a coupling that leaves its mass matrix positive definite.

    The bounds of moment and inertia together reach beyond: there energy has no lower bound, and
    the twin could not be written. The moment follows the coupling.
    """
    most = MOST_COUPLING_SHARE * np.sqrt(theta[MASS] * theta[INERTIA])
    if theta[COUPLING] <= most:
        return theta
    theta = theta.copy()
    theta[[COUPLING, MOMENT]] *= most / theta[COUPLING]
    return theta


def compute_scales(signals: Signals, state: SmoothState, theta: Floats) -> Scales:
    """Return the sizes that this recording of this rig has, for `Parameter.scale`."""
    command = float(np.max(np.abs(signals.command), initial=0.0)) or 1.0
    cart = signals.cart if signals.cart is not None else np.zeros(1)

    def rms(values: Floats) -> float:
        return float(np.sqrt(np.mean(values**2))) or 1.0

    return {
        Scale.ONE: 1.0,
        Scale.COMMAND: command,
        Scale.FORCE: abs(theta[FORCE_PER_PWM]) * command or 1.0,
        Scale.TORQUE: theta[INERTIA] * rms(state.accelerations[:, 1]),
        Scale.CART_SPEED: rms(state.states[:, 2]),
        Scale.CART_TRAVEL: float(np.ptp(cart)) / 2 or 1.0,
        Scale.POLE_RATE: rms(state.states[:, 3]),
        Scale.SECONDS: signals.seconds,
        Scale.CLOCK_END: float(np.max(signals.clock_s)) + signals.period_s,
    }


def compute_size(parameter: Parameter, scales: Scales) -> float:
    """Return what the parameter's probes are fractions of, in its own unit."""
    return scales[parameter.scale] / scales[parameter.per] ** parameter.per_power


def list_effect_parameters(effect: Effect, scales: Scales) -> tuple[Free, ...]:
    """Return the free parameters of an effect; none for one that is only on or off."""
    slot = SLOTS[effect.name]
    return tuple(
        Free(
            f"{effect.name}.{p.name}",
            p.unit,
            (slot.start + k,),
            (1.0,),
            max(p.low, p.fewest * compute_size(p, scales)),
            min(p.high, p.most * compute_size(p, scales)),
            compute_size(p, scales) * max((abs(probe) for probe in p.probes), default=1.0)
            or compute_size(p, scales),
        )
        for k, p in enumerate(effect.parameters)
        if not p.located
    )


def list_free_parameters(twin: Twin, effects: tuple[str, ...], scales: Scales) -> tuple[Free, ...]:
    """List the free parameters of a fit: of the rig and of these effects."""
    return list_rig_parameters(twin) + tuple(
        free for name in effects for free in list_effect_parameters(BY_NAME[name], scales)
    )


def convert_distance(
    estimates: Mapping[str, Estimate], given: Twin, fitted: Twin
) -> dict[str, Estimate]:
    """Return estimates whose com_distance_m goes with the masses of the fitted twin.

    A fit keeps the distance with the given masses: the pole's moment over their sum. Where the
    cart's mass is fitted as well (its spread is given), the twin's distance is of another sum.
    """
    name, converted = "com_distance_m", dict(estimates)
    if name in estimates:
        scale, e = given.rig.total_mass_kg / fitted.rig.total_mass_kg, estimates[name]
        converted[name] = replace(e, value=e.value * scale, low=e.low * scale, high=e.high * scale)
    return converted


def make_twin(
    base: Twin, theta: Floats, effects: tuple[str, ...], rig_free: tuple[Free, ...]
) -> Twin:
    """Make the twin of a fitted theta: base's rig with its free constants replaced.

    Constants that are known stay known; a fitted value has used up what was believed of its
    constant. Where no pole of the measured mass moves like that, mass moves from the cart to the
    pole.

    theta: (SIZE,) fitted parameter vector.
    effects: names of the effects that the twin holds.
    rig_free: the fitted constants of the rig.
    """
    values = {free.name: float(np.clip(free.get(theta), free.low, free.high)) for free in rig_free}
    if "cart_mass_kg" in values and base.rig.com_distance_m is not None:
        total = values["cart_mass_kg"] + (base.rig.pole_mass_kg or 0.0)
        moment = values.get("com_distance_m", base.rig.com_distance_m) * base.rig.total_mass_kg
        values["com_distance_m"] = moment / total
    kept = {}
    for name in effects:
        effect, slot = BY_NAME[name], SLOTS[name]
        kept[name] = {
            p.name: float(theta[slot.start + k]) for k, p in enumerate(effect.parameters)
        }
    rig = move_mass_to_pole(replace(base.rig, **values))
    known = {name: sd for name, sd in base.spreads.items() if sd == 0.0}
    return Twin(base.name, rig, kept, get_laws(theta), known)
