"""Which effects could stand in another one's place on given windows: screened by sensitivities, then refitted.

To first order there are two views, and a tie may hide from either. From afar, with the effect
taken out altogether, large dry friction is no sum of small ones; from near, with the effect made a
little smaller, a delay is a lag. What is close in either view is fitted in the effect's place, and
the distance taken there.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

from pendulum_sysid import decisions
from pendulum_sysid.finding.hypotheses import Shape, make_shape_of, make_shapes
from pendulum_sysid.finding.separation import (
    Tie,
    compute_columns,
    compute_rest,
    is_rival,
    make_nearest_theta,
    spread_indices,
)
from pendulum_sysid.fitting.gauss_newton import solve
from pendulum_sysid.fitting.linearised import Problem
from pendulum_sysid.fitting.parameters import Free, Scales, list_effect_parameters
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Effect
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values
from pendulum_twin.signals import Floats

LITTLE = 0.01  # of an effect, for the view from near


@dataclass(frozen=True)
class Question:
    """Ask what could stand in the place of one effect.

    theta: (SIZE,) of the twin with the effect. free: of the rig's constants and of the other
    effects. power: (channels,) of the errors, weighed by how many windows each of the problem's
    stands for. held: names of the other effects.
    """

    problem: Problem
    power: Floats
    theta: Floats
    effect: Effect
    held: tuple[str, ...]
    free: tuple[Free, ...]
    scales: Scales

    @property
    def without(self) -> Floats:
        """Return the words with the effect taken out."""
        theta = self.theta.copy()
        theta[SLOTS[self.effect.name]] = get_neutral_values(self.effect)
        return theta

    def on_fewer_windows(self, most: int) -> Question:
        """Return the same question on a part of the windows, each of which stands for more."""
        windows = self.problem.windows
        kept = spread_indices(len(windows), most)
        problem = replace(self.problem, windows=windows.pick(kept))
        return replace(self, problem=problem, power=self.power * len(kept) / len(windows))


def tied(
    asked: Question, effects: Sequence[Effect], limit: float, also: Collection[str] = ()
) -> list[Tie]:
    """Return the effects that a fit in the asked one's place brings nearer than a limit, standard errors, nearest first.

    also: effects to be refitted, however far they seem; so is what the asked one contains. An
    effect that the rig's
    constants alone can stand in for is tied to them: then anything could take its place.
    """
    always = {*also, *asked.effect.simpler}
    seen = screened(asked, effects)
    hidden = [
        one for one in seen if one.rival is None and one.distance < decisions.APART_STANDARD_ERRORS
    ]
    if hidden:
        return hidden
    others = [one for one in seen if one.rival is not None]
    near = [one for one in others if one.distance < decisions.SCREENED_STANDARD_ERRORS][
        : decisions.NEAREST_REFITTED
    ]
    near += [
        one for one in others if one.rival in always and not any(one is other for other in near)
    ]
    return sorted(
        (one for one in (refitted(asked, tie) for tie in near) if one.distance < limit),
        key=lambda o: o.distance,
    )


def screened(asked: Question, effects: Sequence[Effect]) -> list[Tie]:
    """Return how far the effect lies from the rig's constants and from other effects to first order, nearest first.

    Of each other effect the nearest of its shapes, in the view in which it is nearer.
    """
    others = [e for e in effects if is_rival(e, asked.effect) and e.name not in asked.held]
    asked = asked.on_fewer_windows(decisions.SCREENING_WINDOWS)
    nearest: dict[str | None, Tie] = {}
    for one in (*_from_afar(asked, others), *_from_near(asked, others)):
        if one.rival not in nearest or one.distance < nearest[one.rival].distance:
            nearest[one.rival] = one
    return sorted(nearest.values(), key=lambda one: one.distance)


def _from_afar(asked: Question, others: Sequence[Effect]) -> list[Tie]:
    tried = tuple(one for e in others for one in make_shapes(asked.without, e, asked.scales))
    return _seen(asked, asked.without, tried, asked.theta, 1.0)


def _from_near(asked: Question, others: Sequence[Effect]) -> list[Tie]:
    if not asked.effect.parameters:
        return []
    tried = tuple(one for e in others for one in make_shapes(asked.theta, e, asked.scales, LITTLE))
    less = make_shape_of(asked.theta, asked.effect, asked.scales).between(
        asked.theta, 1.0 - LITTLE
    )
    return _seen(asked, asked.theta, tried, less, -1.0 / LITTLE)


def _seen(
    asked: Question, theta: Floats, tried: tuple[Shape, ...], target: Floats, times: float
) -> list[Tie]:
    """Return ties about words; the effect is the change from them to target, so many times."""
    found = compute_columns(asked.problem, theta, asked.free, asked.power, tried, target[None])
    wanted = times * found.asked()
    ties = [Tie(asked.effect.name, None, compute_rest(found, wanted).distance, asked.without)]
    for k, one in enumerate(tried):
        if found.shows(k):
            left = compute_rest(found, wanted, k)
            ties.append(
                Tie(
                    asked.effect.name,
                    one.effect.name,
                    left.distance,
                    make_nearest_theta(found, asked.without, k, left),
                )
            )
    return ties


def refitted(asked: Question, tie: Tie) -> Tie:
    """Return a tie with the rival fitted in the effect's place, and how far the two are apart from there."""
    assert tie.rival is not None
    free = (*asked.free, *list_effect_parameters(BY_NAME[tie.rival], asked.scales))
    theta = solve(asked.problem, tie.theta, free, iterations=decisions.REFIT_ITERATIONS).theta
    found = compute_columns(asked.problem, theta, free, asked.power, (), asked.theta[None])
    return replace(tie, distance=compute_rest(found, found.asked()).distance, theta=theta)
