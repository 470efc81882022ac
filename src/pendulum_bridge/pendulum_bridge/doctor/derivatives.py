"""Which field is the derivative of which: motion shows wrong orders and wrong units."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pendulum_bridge.doctor.faults import Fault
from pendulum_bridge.doctor.findings import Check, Finding
from pendulum_bridge.doctor.resting import CART, CART_VELOCITY, POLE, POLE_RATE, has_wraps
from pendulum_bridge.doctor.track import Grid
from pendulum_bridge.doctor.zeros import FIELDS
from pendulum_twin.arrays import Floats

SPAN_S = 0.1  # long against the filter of a velocity, short against what is moved
LEAST_EXPLAINED_SHARE = 0.8  # of the change, by the other field
LEAST_SCALE, MOST_SCALE = 0.6, 1.6
PAIRS = ((POLE, POLE_RATE), (CART, CART_VELOCITY))


@dataclass(frozen=True)
class Fit:
    """Hold how the changes of a field follow the integral of another field.

    scale: factor; 1 for a derivative.
    share: of the changes that the integral explains.
    """

    scale: float
    share: float

    @property
    def proportional(self) -> bool:
        """Return whether the changes follow the integral at all."""
        return self.share > LEAST_EXPLAINED_SHARE

    @property
    def derivative(self) -> bool:
        """Return whether the other field is the field's derivative."""
        return self.proportional and LEAST_SCALE < self.scale < MOST_SCALE


def fit_derivative(position: Floats, velocity: Floats, period_s: float) -> Fit:
    """Return how the changes of a position over SPAN_S follow the integral of a velocity.

    position, velocity: (n,) of the same times; without motion nothing is explained.
    """
    span = min(max(round(SPAN_S / period_s), 1), len(position) - 1)
    changes = position[span:] - position[:-span]
    summed = np.concatenate([[0.0], np.cumsum(0.5 * (velocity[1:] + velocity[:-1]) * period_s)])
    sums = summed[span:] - summed[:-span]
    both, own, other = (
        float(np.sum(a * b)) for a, b in ((changes, sums), (changes, changes), (sums, sums))
    )
    return Fit(both / other, both**2 / (own * other)) if own * other > 0 else Fit(0.0, 0.0)


def check_order(grid: Grid) -> Finding:
    """Return whether each rate is its position's derivative, and the angle has no jumps."""
    expected = "each rate to follow its own position, and an angle without jumps"
    if has_wraps(grid.samples[:, POLE]):
        return Finding(
            Check.FIELDS_MOVING, expected, "an angle that jumps by a whole turn", Fault.WRAPPED
        )
    fits = {pair: _fit_pair(grid, pair) for pair in _list_pairs()}
    if any(fits[pair].derivative for pair in PAIRS):
        return Finding(Check.FIELDS_MOVING, expected, "that")
    for first, second in _list_orders():
        if fits[first].derivative and fits[second].derivative:
            order = dict(zip((*first, *second), FIELDS, strict=True))
            fields = ", ".join(order[k] for k in range(4))
            observed = f"what looks like {fields}, or the same with cart and pole changed"
            return Finding(Check.FIELDS_MOVING, expected, observed, Fault.FIELDS_MIXED)
    return Finding(Check.FIELDS_MOVING, expected, "no other order either")


def check_velocities_moving(grid: Grid) -> Finding:
    """Return whether the velocities are the positions' derivatives, in sign, unit and size."""
    expected = (
        f"pole rate and cart velocity {LEAST_SCALE:g} to {MOST_SCALE:g} times "
        "as differences of positions give them"
    )
    pole, cart = (_fit_pair(grid, pair) for pair in PAIRS)
    texts = [
        f"{name} {_describe_fit(fit)}"
        for name, fit in (("pole rate", pole), ("cart velocity", cart))
    ]
    wrong = not (cart.derivative and (pole.derivative or np.ptp(grid.samples[:, POLE]) == 0.0))
    fault = Fault.VELOCITY_WRONG if wrong else None
    return Finding(Check.VELOCITIES_MOVING, expected, ", ".join(texts), fault)


def _describe_fit(fit: Fit) -> str:
    return f"{1 / fit.scale:.2f} times" if fit.proportional else "that has nothing to do with them"


def _fit_pair(grid: Grid, pair: tuple[int, int]) -> Fit:
    position, velocity = (grid.samples[:, k] for k in pair)
    return fit_derivative(position, velocity, grid.period_s)


def _list_pairs() -> Iterator[tuple[int, int]]:
    return ((i, j) for i in range(4) for j in range(4) if i != j)


def _list_orders() -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
    """Yield two pairs of position and rate that use each field once."""
    for first in _list_pairs():
        position, rate = (k for k in range(4) if k not in first)
        yield first, (position, rate)
        yield first, (rate, position)
