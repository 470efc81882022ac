"""The rigs of a fleet side by side: which is unlike the others, and what most of them lack."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from pendulum_sysid import decisions
from pendulum_sysid.fleet.bounds import clip_family, clip_pooled, clip_to_bounds, get_bounds
from pendulum_sysid.fleet.history import PRESENCE, History, Size
from pendulum_sysid.fleet.pooling import Family, pool_estimates, pool_family
from pendulum_sysid.fleet.rows import RIG
from pendulum_twin.arrays import Floats


@dataclass(frozen=True)
class Unlike:
    """Hold one size in which a rig is unlike the others.

    Attributes:
        rig: its name.
        size: name of the size.
        unit: SI unit.
        value: of the rig, by its own recordings since its last change.
        low, high: where a rig like the others lies with 95 % probability.
        chance: expected number of such findings among rigs that are alike, at most 1.
    """

    rig: str
    size: str
    unit: str
    value: float
    low: float
    high: float
    chance: float


@dataclass(frozen=True)
class Shared:
    """Hold an effect that many rigs lack: how many of how many, and its parameters pooled."""

    effect: str
    rigs: int
    of: int
    parameters: dict[str, tuple[float, float, float, str]]


@dataclass(frozen=True)
class Comparison:
    """Hold the rigs side by side.

    Attributes:
        families: size -> what the rigs have in common, and each rig with what it borrows.
        members: size -> the rigs of its family, in order.
        units: size -> SI unit.
        unlike: the rigs that are unlike the others, the least likely first.
        shared: effects that more than half of the diagnosed rigs lack.
        diagnosed: number of rigs that a diagnosis gave an answer of; a fit names no effect.
    """

    families: dict[str, Family]
    members: dict[str, tuple[str, ...]]
    units: dict[str, str]
    unlike: tuple[Unlike, ...]
    shared: tuple[Shared, ...]
    diagnosed: int


def compare_rigs(histories: Sequence[History]) -> Comparison:
    """Return the rigs of a store side by side, each since its last changes."""
    groups: dict[str, list[tuple[str, Size]]] = defaultdict(list)
    for history in histories:
        for size in history.sizes:
            if size.parameter != PRESENCE:
                groups[size.name].append((history.rig, size))
    large = {name: group for name, group in groups.items() if len(group) >= decisions.LEAST_RIGS}
    questions = sum(len(group) for group in large.values())
    families, unlike = {}, []
    for name, group in large.items():
        first = group[0][1]
        family = pool_family([get_recent(size) for _, size in group])
        families[name] = clip_family(family, get_bounds(first.owner, first.parameter))
        unlike += _find_unlike(name, group, questions)
    return Comparison(
        families,
        {name: tuple(rig for rig, _ in group) for name, group in large.items()},
        {name: group[0][1].unit for name, group in large.items()},
        tuple(sorted(unlike, key=lambda u: u.chance)),
        tuple(_list_shared(histories)),
        sum(history.is_diagnosed for history in histories),
    )


def get_recent(size: Size) -> tuple[Floats, Floats]:
    """Return the estimates since the last change, a drift taken off, and their standard errors."""
    piece = size.course.pieces[-1]
    rows = size.rows.iloc[piece.begin :]
    stamps = np.array([time.timestamp() for time in rows["time"]])
    drift = piece.slope * (stamps - stamps[-1])
    return rows["value"].to_numpy(float) - drift, rows["error"].to_numpy(float)


def _find_unlike(name: str, group: Sequence[tuple[str, Size]], questions: int) -> list[Unlike]:
    """Return the rigs that the other rigs' mean and spread do not expect."""
    values = np.array([size.today.value for _, size in group])
    errors = np.array([size.today.error for _, size in group])
    unlike = []
    bounds = get_bounds(group[0][1].owner, group[0][1].parameter)
    for k, (rig, size) in enumerate(group):
        others = np.arange(len(group)) != k
        usual = pool_estimates(values[others], errors[others])
        degrees = max(int(others.sum()) - 1, 1)
        scale = float(np.sqrt(usual.spread**2 + usual.error**2 + errors[k] ** 2))
        away = abs(values[k] - usual.value) / scale
        chance = float(min(1.0, 2.0 * student.sf(away, degrees) * questions))
        if chance < decisions.FALSE_UNLIKE_SHARE:
            half = scale * float(student.isf(0.025, degrees))
            low, high = (clip_to_bounds(usual.value + side * half, bounds) for side in (-1.0, 1.0))
            unlike.append(Unlike(rig, name, size.unit, float(values[k]), low, high, chance))
    return unlike


def _list_shared(histories: Sequence[History]) -> list[Shared]:
    histories = [history for history in histories if history.is_diagnosed]
    named: Counter[str] = Counter()
    for history in histories:
        named.update(list_effects(history))
    shared = []
    for effect, rigs in named.most_common():
        if rigs > decisions.SHARED_BY_RIGS * len(histories) and rigs > 1:
            sizes: dict[str, list[Size]] = defaultdict(list)
            for history in histories:
                if effect not in list_effects(history):
                    continue
                for size in history.sizes:
                    if size.owner == effect and size.parameter != PRESENCE:
                        sizes[size.parameter].append(size)
            parameters = {}
            for parameter, group in sizes.items():
                pooled = pool_estimates(
                    np.array([s.today.value for s in group]),
                    np.array([s.today.error for s in group]),
                )
                pooled = clip_pooled(pooled, get_bounds(effect, parameter))
                parameters[parameter] = (pooled.value, pooled.low, pooled.high, group[0].unit)
            shared.append(Shared(effect, rigs, len(histories), parameters))
    return shared


def list_effects(history: History) -> list[str]:
    """Return the effects that are the rig's: named in most recordings since they changed."""
    return [
        size.owner
        for size in history.sizes
        if size.owner != RIG
        and size.parameter == PRESENCE
        and size.today.value > decisions.NAMED_OFTEN
    ]


def describe_comparison(comparison: Comparison) -> list[str]:
    """Return the answer in sentences."""
    lines = [
        f"{u.rig} is unlike the others in {u.size}: {u.value:.4g} {u.unit}, expected "
        f"{u.low:.4g} to {u.high:.4g}; rigs that are alike show as much once in "
        f"{1 / max(u.chance, 1e-9):.3g} fleets."
        for u in comparison.unlike
    ]
    for shared in comparison.shared:
        values = ", ".join(
            f"{name} {value:.4g} [{low:.4g}, {high:.4g}] {unit}"
            for name, (value, low, high, unit) in shared.parameters.items()
        )
        lines.append(
            f"{shared.effect} is missing in {shared.rigs} of {shared.of} rigs: it belongs into "
            f"the nominal twin{f', with {values}' if values else ''}."
        )
    if not comparison.families:
        lines.append(
            f"Whether a rig is unlike the others cannot be said: fewer than "
            f"{decisions.LEAST_RIGS} rigs share a size."
        )
    if lines:
        return lines
    if not comparison.diagnosed:
        return ["No rig is unlike the others. No effect was asked for: a fit names none."]
    return ["No rig is unlike the others, and no missing effect is shared by most."]
