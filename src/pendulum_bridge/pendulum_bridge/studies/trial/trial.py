"""A trial: what is concealed in it, drawn from the seed of the run and the trial's number."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from pendulum_bridge.emulator.conceal import complete_set, conceal_effects
from pendulum_bridge.emulator.concealable import TABLE
from pendulum_bridge.emulator.rest import draw_rest
from pendulum_bridge.emulator.seal import Concealed
from pendulum_bridge.emulator.unlisted.table import BY_NAME as UNLISTED
from pendulum_bridge.studies.trial.mix import EFFECTS_OF_KIND, find_kind
from pendulum_twin.rig import Rig

KIND_OF_COUNT = {0: "nothing", 1: "single", 2: "pair", 3: "triple", 4: "quadruple"}


@dataclass(frozen=True)
class Trial:
    """Hold a trial.

    number: in its run, from 0.
    kind: see `mix`.
    seed: of all that is random in it.
    concealed: the truth.
    """

    number: int
    kind: str
    seed: int
    concealed: Concealed


def derive_seed(run_seed: int, number: int) -> int:
    """Return the seed of a trial of a run."""
    return int(np.random.SeedSequence([run_seed, number]).generate_state(1)[0])


def draw_trial(
    number: int, run_seed: int, shares: Mapping[str, int], nominal: Rig, size_factor: float = 1.0
) -> Trial:
    """Return the trial with this number.

    The shares decide its kind; its first effect goes round all effects in turn.
    shares: kind -> share.
    nominal: the rig of which the constants are perturbed.
    size_factor: multiplies the sizes of the effects.
    """
    kind, turn = find_kind(number, shares)
    seed = derive_seed(run_seed, number)
    names = _draw_names(kind, turn, run_seed, seed)
    return Trial(number, kind, seed, conceal_effects(names, seed, nominal, size_factor))


def draw_trial_with(
    number: int,
    run_seed: int,
    sets: Sequence[Sequence[str]],
    nominal: Rig,
    size_factor: float = 1.0,
) -> Trial:
    """Return the trial with this number, with given effects.

    sets: names of effects, catalogued or not; the trials take the sets in turn.
    nominal, size_factor: see `draw_trial`.
    """
    names = sets[number % len(sets)]
    seed = derive_seed(run_seed, number)
    kind = "unlisted" if set(names) & UNLISTED.keys() else KIND_OF_COUNT[min(len(names), 4)]
    return Trial(number, kind, seed, conceal_effects(names, seed, nominal, size_factor))


def add_rest(trial: Trial) -> Trial:
    """Return the trial with a realistic rest, drawn by its seed; see `emulator.rest`."""
    rest = draw_rest(trial.seed, trial.concealed.unlisted)
    return replace(trial, concealed=replace(trial.concealed, rest=rest))


def _draw_names(kind: str, turn: int, run_seed: int, seed: int) -> tuple[str, ...]:
    if kind == "unlisted":
        return (_take_in_turn(tuple(UNLISTED), turn, run_seed),)
    count = EFFECTS_OF_KIND[kind]
    # an effect that needs another effect beside it cannot be drawn alone
    names = tuple(effect.name for effect in TABLE if count > 1 or not effect.beside)
    return complete_set([_take_in_turn(names, turn, run_seed)], count, seed) if count else ()


def _take_in_turn(names: tuple[str, ...], turn: int, run_seed: int) -> str:
    """Return the name whose turn it is, in the order that the run's seed draws."""
    return names[int(np.random.default_rng(run_seed).permutation(len(names))[turn % len(names)])]
