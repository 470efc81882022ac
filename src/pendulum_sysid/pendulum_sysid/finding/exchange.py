"""Find which effects could stand in the place of another on given windows.

Effects are screened by sensitivities, then refitted. To first order there are two views, and a tie
may hide from either. From afar, with the effect taken out altogether, large dry friction is no sum
of small effects; from near, with the effect made a little smaller, a delay is a lag. What is close
in either view is fitted in the effect's place, and the distance is measured there.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from pendulum_sysid import decisions
from pendulum_sysid.finding.hypotheses import EffectShape, make_shape_of, make_shapes
from pendulum_sysid.finding.separation import (
    Tie,
    compute_columns,
    compute_rest,
    is_rival,
    make_nearest_theta,
    spread_indices,
)
from pendulum_sysid.fitting.gauss_newton import solve
from pendulum_sysid.fitting.parameters import Free, Scales, list_effect_parameters
from pendulum_sysid.fitting.problem import Problem
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values

LITTLE = 0.01  # of an effect, for the view from near


@dataclass(frozen=True)
class ExchangeQuestion:
    """Ask what could stand in the place of one effect.

    problem: the windows that decide.
    power: (channels,) of the errors, weighed by how many windows each of the problem's stands for.
    theta: (SIZE,) of the twin with the effect.
    effect: whose place is asked about.
    others: names of the other effects.
    free: parameters of the rig's constants and of the other effects.
    scales: typical sizes of the recording.
    """

    problem: Problem
    power: Floats
    theta: Floats
    effect: Effect
    others: tuple[str, ...]
    free: tuple[Free, ...]
    scales: Scales

    @property
    def theta_without(self) -> Floats:
        """Return theta (SIZE,) with the effect taken out."""
        theta = self.theta.copy()
        theta[SLOTS[self.effect.name]] = get_neutral_values(self.effect)
        return theta

    def pick_windows(self, most: int) -> ExchangeQuestion:
        """Return the same question on some of the windows, each of which stands for more."""
        windows = self.problem.windows
        kept = spread_indices(len(windows), most)
        problem = replace(self.problem, windows=windows.pick(kept))
        return replace(self, problem=problem, power=self.power * len(kept) / len(windows))


def find_near_effects(
    question: ExchangeQuestion,
    effects: Sequence[Effect],
    limit: float,
    also: Collection[str] = (),
) -> list[Tie]:
    """Return the effects that, fitted in the effect's place, come nearer than a limit.

    The nearest comes first. An effect that the rig's constants alone can stand in for is tied to
    them: then anything could take its place.

    limit: standard errors.
    also: effects to be refitted, however far they seem; so is what the effect itself contains.
    """
    always = {*also, *question.effect.simpler}
    ties = screen_effects(question, effects)
    apart = decisions.APART_STANDARD_ERRORS
    hidden = [tie for tie in ties if tie.rival is None and tie.distance < apart]
    if hidden:
        return hidden
    others = [tie for tie in ties if tie.rival is not None]
    near = [tie for tie in others if tie.distance < decisions.SCREENED_STANDARD_ERRORS]
    near = near[: decisions.NEAREST_REFITTED]
    names = {tie.rival for tie in near}
    near += [tie for tie in others if tie.rival in always and tie.rival not in names]
    refitted = [refit_tie(question, tie) for tie in near]
    return sorted((t for t in refitted if t.distance < limit), key=lambda tie: tie.distance)


def screen_effects(question: ExchangeQuestion, effects: Sequence[Effect]) -> list[Tie]:
    """Return how far the effect lies from other effects and constants to first order.

    The nearest comes first: of each other effect the nearest of its shapes, in the view in which
    it is nearer.
    """
    effect = question.effect
    others = [
        e for e in effects if is_rival(e, effect, question.free) and e.name not in question.others
    ]
    question = question.pick_windows(decisions.SCREENING_WINDOWS)
    nearest: dict[str | None, Tie] = {}
    for tie in (*_view_from_afar(question, others), *_view_from_near(question, others)):
        if tie.rival not in nearest or tie.distance < nearest[tie.rival].distance:
            nearest[tie.rival] = tie
    return sorted(nearest.values(), key=lambda tie: tie.distance)


def _view_from_afar(question: ExchangeQuestion, others: Sequence[Effect]) -> list[Tie]:
    """Return the distances where the effect is taken out altogether."""
    theta, scales = question.theta_without, question.scales
    tried = tuple(shape for other in others for shape in make_shapes(theta, other, scales))
    return _measure_distances(question, theta, tried, question.theta, 1.0)


def _view_from_near(question: ExchangeQuestion, others: Sequence[Effect]) -> list[Tie]:
    """Return the distances where the effect is made a little smaller."""
    theta, scales = question.theta, question.scales
    if not question.effect.parameters:
        return []
    tried = tuple(shape for other in others for shape in make_shapes(theta, other, scales, LITTLE))
    own = make_shape_of(theta, question.effect, scales)
    smaller = own.between(theta, 1.0 - LITTLE)
    return _measure_distances(question, theta, tried, smaller, -1.0 / LITTLE)


def _measure_distances(
    question: ExchangeQuestion,
    theta: Floats,
    tried: tuple[EffectShape, ...],
    target: Floats,
    times: float,
) -> list[Tie]:
    """Return ties about theta; the effect is the change from theta to a target, so many times."""
    columns = compute_columns(
        question.problem, theta, question.free, question.power, tried, target[None]
    )
    name, without, wanted = (
        question.effect.name,
        question.theta_without,
        times * columns.get_target(),
    )
    ties = [Tie(name, None, compute_rest(columns, wanted).distance, without)]
    for k, shape in enumerate(tried):
        if columns.is_visible(k):
            residual = compute_rest(columns, wanted, k)
            nearest = make_nearest_theta(columns, without, k, residual)
            ties.append(Tie(name, shape.effect.name, residual.distance, nearest))
    return ties


def refit_tie(question: ExchangeQuestion, tie: Tie) -> Tie:
    """Return a tie with the rival fitted in the effect's place, and the distance from there."""
    assert tie.rival is not None
    free = (*question.free, *list_effect_parameters(BY_NAME[tie.rival], question.scales))
    iterations = decisions.REFIT_ITERATIONS
    theta = solve(question.problem, tie.theta, free, iterations=iterations).theta
    columns = compute_columns(
        question.problem, theta, free, question.power, (), question.theta[None]
    )
    distance = compute_rest(columns, columns.get_target()).distance
    return replace(tie, distance=distance, theta=theta)
