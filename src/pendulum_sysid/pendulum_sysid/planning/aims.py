"""The aims of an experiment: to part two twins, or to narrow an interval or a law's band."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.separation import (
    ColumnProducts,
    Tie,
    compute_columns,
    compute_deviations,
    compute_rest,
    pose_on_deciding_windows,
)
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import Free, list_free_parameters
from pendulum_sysid.fitting.problem import Problem
from pendulum_sysid.records import Fit, Split
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Form


@dataclass(frozen=True, eq=False)
class Linearisation:
    """Hold about which twin, and in which parameters, the errors of runs are linearised.

    theta: (SIZE,) parameter vector of the twin.
    free: the parameters.
    targets: (targets, SIZE) twins, the changes to which are columns as well; None for none.

    Aims that hold the same linearisation share its normal matrix.
    """

    theta: Floats
    free: tuple[Free, ...]
    targets: Floats | None = None

    def compute_normal(self, problem: Problem, power: Floats) -> Floats:
        """Return the normal matrix on windows of another recording, without beliefs."""
        free = forget_beliefs(self.free)
        return compute_columns(problem, self.theta, free, power, (), self.targets).normal


class Aim(Protocol):
    """Say what every aim offers.

    subject: what the aim is about, for a person.
    mover: (SIZE,) parameter vector of the twin that plays the plan.
    linearisation: the columns that the aim is judged by.
    normal: normal matrix of the aim's directions on the recordings at hand.
    """

    @property
    def subject(self) -> str:
        """Return what the aim is about."""

    @property
    def mover(self) -> Floats:
        """Return the parameter vector of the twin that plays the plan."""

    @property
    def normal(self) -> Floats:
        """Return the normal matrix on the recordings at hand."""

    @property
    def linearisation(self) -> Linearisation:
        """Return the columns that the aim is judged by."""

    def turn(self, normal: Floats) -> Floats:
        """Return the normal matrix of the aim's directions from that of the linearisation."""

    def rate(self, normal: Floats) -> float:
        """Return how well a normal matrix serves the aim; more is better."""


@dataclass(frozen=True)
class Parting:
    """Tell a twin from a rival whose free parameters follow as far as they can.

    mover: (SIZE,) parameter vector of the twin that plays.
    linearisation: about the rival, in its parameters that follow, with the change to the mover.
    """

    subject: str
    mover: Floats
    linearisation: Linearisation
    normal: Floats

    def turn(self, normal: Floats) -> Floats:
        """Return the normal matrix of the rival's columns and of the difference of the twins."""
        return normal

    def rate(self, normal: Floats) -> float:
        """Return the standard errors between the two twins."""
        free = self.linearisation.free
        columns = ColumnProducts(normal, free, (), (), len(free))
        return compute_rest(columns, columns.get_target()).distance


@dataclass(frozen=True)
class Narrowing:
    """Narrow the interval of a parameter, or the band of a measured law.

    linearisation: about the fitted twin, in all parameters of the fit.
    halves: (values,) half widths of the interval, or of the band at its knots, now, in `unit`;
        infinite where nothing is fixed.
    scale: magnitude of the value, or its typical size where the value is smaller, in `unit`.
    directions: (parameters, directions) along which the parameters move.
    sums: (values, directions) of the directions that make each value, in `unit`.
    normal: of the directions; what is believed of them counts in.
    """

    subject: str
    linearisation: Linearisation
    halves: Floats
    scale: float
    unit: str
    directions: Floats
    sums: Floats
    normal: Floats

    @property
    def half(self) -> float:
        """Return the half width of the interval now, of a band the mean."""
        return float(np.mean(self.halves))

    @property
    def mover(self) -> Floats:
        """Return the parameter vector of the fitted twin."""
        return self.linearisation.theta

    def turn(self, normal: Floats) -> Floats:
        """Return the normal matrix of the directions."""
        turned: Floats = self.directions.T @ normal @ self.directions
        return turned

    def rate(self, normal: Floats) -> float:
        """Return the value over the half width that is to be expected."""
        return self.scale / max(self.predict_half_width(normal), 1e-300)

    def predict_half_width(self, normal: Floats) -> float:
        """Return the half width to be expected: today's, shrunk as the information grows.

        A band shrinks at every knot by itself.
        """
        now, then = (compute_deviations(n, self.sums) for n in (self.normal, normal))
        known = np.isfinite(self.halves) & np.isfinite(now)
        shrunk = self.halves * then / np.where(known, now, 1.0)
        return float(np.mean(np.where(known, shrunk, decisions.INTERVAL_DEVIATIONS * then)))


def forget_beliefs(free: tuple[Free, ...]) -> tuple[Free, ...]:
    """Return free parameters of which nothing is believed: a belief is no data of a run.

    At which samples of a recording the values of laws act says nothing of another run either.
    """
    return tuple(replace(parameter, spread=np.inf, acts=None) for parameter in free)


def make_partings(case: Case, split: Split, best: Fit, tie: Tie) -> list[Parting]:
    """Return the two aims of a tie: each twin follows the other in turn."""
    assert tie.rival is not None
    rivals = (*(name for name in best.effects if name != tie.effect), tie.rival)
    free = list_free_parameters(case.twin, rivals, case.scales)
    own = list_free_parameters(case.twin, best.effects, case.scales)
    problem, power = pose_on_deciding_windows(case, split, best)
    aims = []
    for mover, rival, follows in ((best.theta, tie.theta, free), (tie.theta, best.theta, own)):
        about = Linearisation(rival, follows, mover[None])
        columns = compute_columns(problem, rival, follows, power, (), about.targets)
        aims.append(Parting(f"{tie.effect} and {tie.rival}", mover, about, columns.normal))
    return aims


def list_narrowings(case: Case, split: Split, best: Fit) -> list[Narrowing]:
    """Return an aim for each interval of a fit; what is not fixed has an infinite interval."""
    free = list_free_parameters(case.twin, best.effects, case.scales)
    if not free:
        return []
    problem, power = pose_on_deciding_windows(case, split, best)
    normal = compute_columns(problem, best.theta, free, power).normal
    about, aims, axes = Linearisation(best.theta, free), [], np.eye(len(free))
    for k, parameter in enumerate(free):
        if not is_fitted_to_positions(parameter.name):
            continue
        estimate = best.estimates[parameter.name]
        unfixed = estimate.low <= parameter.low and estimate.high >= parameter.high
        half = max(estimate.high - estimate.value, estimate.value - estimate.low)
        aims.append(
            Narrowing(
                subject=parameter.name,
                linearisation=about,
                halves=np.array([np.inf if unfixed else half]),
                scale=max(abs(parameter.get(best.theta)), parameter.size),
                unit=parameter.unit,
                directions=axes,
                sums=axes[k : k + 1] * parameter.size,
                normal=normal,
            )
        )
    return aims


def is_fitted_to_positions(name: str) -> bool:
    """Return whether more motion fixes a parameter better.

    name: "key" or "effect.parameter". An instant that is read off the recording is not fitted to
    positions, nor is what only the reported velocities show.
    """
    effect, _, parameter = name.partition(".")
    if not parameter:
        return True
    located = next(p.located for p in BY_NAME[effect].parameters if p.name == parameter)
    return not located and BY_NAME[effect].form is not Form.REPORT
