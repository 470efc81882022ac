"""How a seed draws what an emulated rig conceals: effects, sizes, and wrong constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np

from pendulum_bridge.emulator.concealable import BY_NAME, FIRST_ENTRIES, TABLE, Concealable, Span
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted.table import BY_NAME as UNLISTED
from pendulum_twin.errors import BadInputError
from pendulum_twin.rig import Rig

# The constants of which the nominal values are wrong. The cart's mass is right: motion alone shows
# only ratios to it.
PERTURBED_CONSTANTS = (
    "cart_viscous_n_s_m",
    "pole_viscous_n_m_s",
    "force_per_pwm_n",
    "com_distance_m",
    "pole_inertia_kg_m2",
)
LARGEST_PERTURBATION = 0.2  # share of the nominal value


def draw_concealed(seed: int, count: int, nominal: Rig, live: bool = False) -> Concealed:
    """Return `count` effects of realistic size, and the nominal rig with wrong constants.

    The same seed gives the same rig.
    live: whether the rig is driven live, so that it has no effect of one recording only.
    Raises BadInputError when more effects are asked for than go together.
    """
    return conceal_effects(complete_set((), count, seed, live), seed, nominal)


def count_families(live: bool = False) -> int:
    """Return how many effects can be concealed together; live: see `draw_concealed`."""
    return len({entry.family for entry in _list_candidates(live)})


def complete_set(
    names: Sequence[str], count: int, seed: int, live: bool = False
) -> tuple[str, ...]:
    """Return the effects and as many more, drawn by the seed, as make `count` that go together.

    Raises BadInputError when so many do not go together.
    """
    families = count_families(live)
    if not 0 <= count <= families:
        raise BadInputError(f"effects: expected a number from 0 to {families}, found {count}")
    random = np.random.default_rng(seed)
    chosen = [BY_NAME[name] for name in names]
    candidates = _list_candidates(live)
    order = [entry for entry in _order_table(random, seed) if entry in candidates]
    whole = _add_effects(chosen, order, count)
    if whole is None:
        raise BadInputError(f"effects: expected names that go with {count} effects, found {names}")
    return tuple(entry.name for entry in whole)


def _add_effects(
    chosen: list[Concealable], order: Sequence[Concealable], count: int
) -> list[Concealable] | None:
    """Return a set of so many effects, the first of the order that goes on; None without any."""
    if len(chosen) >= count:
        return chosen
    for entry in order:
        if _is_compatible(entry, chosen, count):
            whole = _add_effects([*chosen, entry], order, count)
            if whole is not None:
                return whole
    return None


def _order_table(random: np.random.Generator, seed: int) -> list[Concealable]:
    """Return the table in the order in which a seed takes from it; every order is as likely."""
    order = [TABLE[k] for k in random.permutation(FIRST_ENTRIES)]
    for k, entry in enumerate(TABLE[FIRST_ENTRIES:], FIRST_ENTRIES):
        place = np.random.default_rng([seed, 3, k]).integers(0, k + 1)
        order.insert(int(place), entry)
    return order


def _list_candidates(live: bool) -> list[Concealable]:
    return [entry for entry in TABLE if not live or entry.is_of_live_rig]


def _is_compatible(candidate: Concealable, chosen: Sequence[Concealable], count: int) -> bool:
    """Return whether every effect has, or can still get, what it needs beside it."""
    names = {entry.name for entry in chosen}
    lacking = next(
        (entry.beside for entry in chosen if entry.beside and not names & set(entry.beside)), ()
    )
    if candidate.family in {entry.family for entry in chosen} or (
        lacking and candidate.name not in lacking
    ):
        return False
    return not candidate.beside or bool(names & set(candidate.beside)) or len(chosen) + 2 <= count


def conceal_effects(
    names: Sequence[str], seed: int, nominal: Rig, size_factor: float = 1.0
) -> Concealed:
    """Return the effects with sizes drawn by the seed, and the nominal rig with wrong constants.

    names: of this table, or of unlisted effects.
    size_factor: multiplies the sizes.
    The seed's constants are the same whatever is concealed.
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
    """An effect of which the sizes can be drawn; see `Concealable`."""

    @property
    def sizes(self) -> Mapping[str, Span]:
        """Return parameter -> lowest and highest size."""

    @property
    def both_ways(self) -> bool:
        """Return whether the sign is drawn."""

    @property
    def shapes(self) -> tuple[str, ...]:
        """Return the parameters that are no sizes."""

    @property
    def neutral(self) -> float:
        """Return the size at which the effect vanishes."""


def draw_sizes(effect: Sized, random: np.random.Generator, factor: float) -> dict[str, float]:
    """Return drawn parameters; the factor multiplies the distance of a size from neutral."""
    sign = random.choice([-1.0, 1.0]) if effect.both_ways else 1.0
    drawn = {name: float(random.uniform(*span)) for name, span in effect.sizes.items()}
    scaled = {
        name: effect.neutral + factor * (sign * value - effect.neutral)
        for name, value in drawn.items()
    }
    return {name: drawn[name] if name in effect.shapes else scaled[name] for name in drawn}


def _perturb_rig(nominal: Rig, random: np.random.Generator) -> Rig:
    factors = {
        name: 1 + random.uniform(-LARGEST_PERTURBATION, LARGEST_PERTURBATION)
        for name in PERTURBED_CONSTANTS
    }
    return replace(
        nominal,
        **{name: float(getattr(nominal, name) * factor) for name, factor in factors.items()},
    )
