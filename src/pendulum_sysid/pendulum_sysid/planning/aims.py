"""What a next experiment is to achieve: twins to be told apart, or an interval to be narrowed."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from pendulum_sysid.finding.separation import (
    CERTAIN,
    Columns,
    Tie,
    compute_columns,
    compute_deviations,
    compute_rest,
    pick_deciding_windows,
)
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.linearised import Problem
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.records import Fit, Split
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form
from pendulum_twin.signals import Floats


class Aim(Protocol):
    """What every aim offers. said: what it is about. mover: (SIZE,) the twin that moves when it is asked."""

    @property
    def said(self) -> str:
        """Return what it is about."""

    @property
    def mover(self) -> Floats:
        """Return the words of the twin that moves."""

    @property
    def normal(self) -> Floats:
        """Return the products of its columns on the recordings at hand."""

    def products(self, problem: Problem, power: Floats) -> Floats:
        """Return the same on windows of another recording."""

    def worth(self, normal: Floats) -> float:
        """Return how near it comes to being achieved with such products; more is better."""


@dataclass(frozen=True)
class Parting:
    """Tell one twin from a rival in all that the rival's parameters can do.

    mover: (SIZE,) words of the one; rival: of the other, whose free parameters follow.
    """

    said: str
    mover: Floats
    rival: Floats
    free: tuple[Free, ...]
    normal: Floats

    def products(self, problem: Problem, power: Floats) -> Floats:
        """Return the products of the rival's parameters' columns and of the difference between the twins."""
        return compute_columns(problem, self.rival, self.free, power, (), self.mover[None]).normal

    def worth(self, normal: Floats) -> float:
        """Return standard errors between the two."""
        found = Columns(normal, self.free, (), (), len(self.free))
        return compute_rest(found, found.asked()).distance


@dataclass(frozen=True)
class Narrowing:
    """Narrow the interval of one free parameter. half: of its width now, in its own unit, infinite where it is unfixed."""

    said: str
    mover: Floats
    free: tuple[Free, ...]
    number: int
    half: float
    normal: Floats

    def products(self, problem: Problem, power: Floats) -> Floats:
        """Return the products of the parameters' columns."""
        return compute_columns(problem, self.mover, self.free, power).normal

    def worth(self, normal: Floats) -> float:
        """Return 1 / the half width that is to be expected, as a share of the value."""
        return self.scale / max(self.expected(normal), 1e-300)

    @property
    def scale(self) -> float:
        """Return what the width is compared with: the value, or the parameter's size where the value is less."""
        one = self.free[self.number]
        return max(abs(one.get(self.mover)), one.size)

    def expected(self, normal: Floats) -> float:
        """Return the half width that is to be expected: today's, shrunk as the information grows."""
        now, then = (compute_deviations(one)[self.number] for one in (self.normal, normal))
        if np.isfinite(self.half) and np.isfinite(now):
            return float(self.half * then / now)
        return float(CERTAIN * then * self.free[self.number].size)


def make_partings(case: Case, split: Split, best: Fit, tie: Tie) -> list[Parting]:
    """Return the two questions of a tie, each twin asked to look like the other."""
    assert tie.rival is not None
    rivals = (*(name for name in best.effects if name != tie.effect), tie.rival)
    free = list_free_parameters(case.twin, rivals, case.scales)
    own = list_free_parameters(case.twin, best.effects, case.scales)
    windows, weight = pick_deciding_windows(case.state, split, best.parts)
    at_hand, power = case.problem(windows), best.power / weight
    made = []
    for moves, stands, parameters in ((best.theta, tie.theta, free), (tie.theta, best.theta, own)):
        one = Parting(f"{tie.effect} and {tie.rival}", moves, stands, parameters, np.empty(0))
        made.append(replace(one, normal=one.products(at_hand, power)))
    return made


def list_narrowings(case: Case, split: Split, best: Fit, at_least: float) -> list[Narrowing]:
    """Return the intervals of a fit that are wider than a share of their value, the widest first; an infinite one counts."""
    free = list_free_parameters(case.twin, best.effects, case.scales)
    windows, weight = pick_deciding_windows(case.state, split, best.parts)
    normal = compute_columns(case.problem(windows), best.theta, free, best.power / weight).normal
    made = []
    for k, one in enumerate(free):
        if not is_fitted_to_positions(one.name):
            continue
        found = best.estimates[one.name]
        unfixed = found.low <= one.low and found.high >= one.high
        half = np.inf if unfixed else max(found.high - found.value, found.value - found.low)
        made.append(Narrowing(one.name, best.theta, free, k, half, normal))
    wide = [one for one in made if one.half > at_least * one.scale]
    return sorted(wide, key=lambda one: one.half / one.scale, reverse=True)


def is_fitted_to_positions(name: str) -> bool:
    """Return whether a parameter ("key" or "effect.parameter") is one that more motion fixes better.

    A moment that is read off the recording is not, nor what only the reported velocities show.
    """
    effect, _, parameter = name.partition(".")
    if not parameter:
        return True
    located = next(p.located for p in BY_NAME[effect].parameters if p.name == parameter)
    return not located and BY_NAME[effect].form is not Form.REPORT
