"""Name what is missing: signs first, then a set of effects grown one by one with joint refits, then pruned.

Forward selection and backward elimination (Miller, Subset Selection in Regression (2002), chapter
3), each step judged on windows that were kept for choosing. This loop and `pipeline` are the only
ones that know several stages.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pendulum_sysid.finding import judge
from pendulum_sysid.finding.pole_alone import put_pole_on_moving_axis
from pendulum_sysid.finding.propose import hand_over, propose
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.fit import HORIZONS, fit
from pendulum_sysid.fitting.gauss_newton import refined
from pendulum_sysid.fitting.split import split
from pendulum_sysid.fitting.windows import WINDOW_S
from pendulum_sysid.records import Fit, Split, Trial
from pendulum_twin.effects import BY_NAME
from pendulum_twin.effects.effect import Place
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values, make_theta
from pendulum_twin.signals import Floats

Progress = Callable[[str], None]
REFITTED = 5  # candidates that are fitted in full at every step
MOST_EFFECTS = 5
NEAR_FLOOR = 1.5  # misfit over a short horizon
RIVALS = 3
OTHERS = 2  # beginnings that are tried where the first one leaves more than noise
SIGNS = ("cart_sign_inverted", "angle_sign_inverted", "input_sign_inverted")
SIGN_WORTH = 1.2  # factor of misfit below which a sign is not believed to be wrong


@dataclass(frozen=True)
class PoleAlone:
    """Hold the search on the pole by itself, its axis moved as recorded: what was fixed, and what it found."""

    search: Search
    base: Fit
    best: Fit


@dataclass
class Search:
    """Hold the case and what has been tried so far."""

    case: Case
    split: Split
    progress: Progress
    trials: list[Trial] = field(default_factory=list)
    expected: tuple[str, ...] = ()  # named by the pole by itself
    pole: PoleAlone | None = None

    def fitted(self, effects: tuple[str, ...], start: Fit, theta: Floats) -> Fit:
        """Return the best fit of these effects from some start words (starts, SIZE), warm from another fit."""
        starts = start.starts
        fits = [
            fit(self.case, self.split, effects, one, start.parts, starts)
            for one in np.atleast_2d(theta)
        ]
        return min(fits, key=lambda one: one.train)

    def note(self, one: Fit, verdict: str) -> None:
        """Keep a row for the report's table."""
        self.trials.append(Trial(one.effects, one.train, one.choose, verdict))


def parameters_alone(search: Search) -> Fit:
    """Return the best fit of the rig's constants alone, the signs of the channels asked first.

    Mirroring cart, pole and command together changes nothing, so one wrong sign at a time covers
    every case.
    """
    case = search.case
    theta = make_theta(case.twin)
    held = tuple(case.twin.effects)
    plain = fit(case, search.split, held, theta, HORIZONS[0])
    search.note(plain, "parameters alone")
    turned = []
    for sign in SIGNS:
        if sign not in held and _makes_sense(case, sign):
            other = theta.copy()
            other[SLOTS[sign]] = 1.0
            turned.append(fit(case, search.split, (*held, sign), other, HORIZONS[0]))
            search.note(turned[-1], "one sign turned")
    best = min(turned, key=lambda one: one.choose, default=plain)
    if best.choose * SIGN_WORTH < plain.choose:
        return best
    return settled(
        search, plain, [one for one in turned if one.choose < SIGN_WORTH * plain.choose]
    )


def settled(search: Search, plain: Fit, doubtful: list[Fit]) -> Fit:
    """Return the constants with a sign turned that they leave in doubt, when only with it a search ends at the noise.

    Under a wrong scale of the angle a wrong sign is as bad as the right one.
    """
    for one in sorted(doubtful, key=lambda one: one.choose):
        search.progress(
            f"misfit {plain.choose:.2f}, and {one.choose:.2f} with {one.effects[-1]}: asking what either lacks"
        )
        end = grown(search, one).choose
        if end <= NEAR_FLOOR and end * SIGN_WORTH < grown(search, plain).choose:
            return one
    return plain


def _makes_sense(case: Case, sign: str) -> bool:
    rig = case.twin.rig
    if rig.has_cart and rig.has_pole:
        return True
    return rig.has_cart and sign == "input_sign_inverted"


def grown(search: Search, base: Fit) -> Fit:
    """Return the base with effects added one by one, as long as one is really ahead on the choosing windows."""
    best = base
    while len(best.effects) < len(base.effects) + MOST_EFFECTS:
        good = steps(search, best)
        if not good:
            break
        best = good[0]
    return best


def steps(search: Search, best: Fit) -> list[Fit]:
    """Return the fits with one effect more that are really ahead on the choosing windows, the one to keep first."""
    search.progress(
        f"misfit {best.choose:.2f} with {', '.join(best.effects) or 'no effects'}: asking what is missing"
    )
    proposals = propose(search.case, search.split, best)[:REFITTED]
    fits = [search.fitted(one.effects, best, one.theta) for one in proposals]
    good = [one for one in fits if judge.needed(one, best, one.effects[-1])]
    chosen = judge.simplest(good) if good else None
    for one in fits:
        search.note(
            one,
            "kept"
            if one is chosen
            else "no better than the one kept"
            if one in good
            else "not needed",
        )
    return sorted(good, key=lambda one: (one is not chosen, one.choose))


def seen_from(search: Search, one: Fit, parts: int) -> Fit:
    """Return the same set of effects fitted over another horizon."""
    other = fit(search.case, search.split, one.effects, one.theta, parts)
    search.note(other, f"over {WINDOW_S / parts:g} s")
    return other


def missing(search: Search, base: Fit) -> Fit:
    """Return the base with what is missing named: over a short horizon first, then over a long one.

    A short horizon keeps errors where they arise, a long one lets small ones add up until they
    show. But what is still
    wrong adds up as well: then the long horizon may add to what the short one found, and takes
    nothing away.
    """
    told = with_pole_effects(search, base)
    first = steps(search, told)
    found = pruned(search, base.effects, grown(search, first[0]) if first else told)
    short = begun_otherwise(search, base, first, found)
    grown_long = grown(search, seen_from(search, short, 1))
    if grown_long.choose <= NEAR_FLOOR:
        return confirmed(search, short, pruned(search, base.effects, grown_long))
    long = pruned(search, short.effects, grown_long)
    near = short
    if long.effects != short.effects:
        near = pruned(search, base.effects, seen_from(search, long, short.parts))
    return long if judge.lead(long, over_whole_windows(search, near)).real else near


def begun_otherwise(search: Search, base: Fit, first: list[Fit], found: Fit) -> Fit:
    """Return a search with another first step when it ends at the noise and what was found does not; else what was found.

    Growing one by one is bound to its beginning: a broad friction patch takes the place of dry
    friction and a narrow one, and what the pole said by itself may be an answer to a wrong scale
    of the cart's way. first: the steps there were.
    """
    if found.choose <= NEAR_FLOOR:
        return found
    search.progress(f"misfit {found.choose:.2f} is more than noise: beginning with other steps")
    others = (
        simplest_of_each(steps(search, base))
        if search.expected
        else simplest_of_each(first, first[:1])
    )
    for begin in others[:OTHERS]:
        other = grown(search, begin)
        if other.choose <= NEAR_FLOOR and judge.lead(other, found).real:
            search.expected, search.pole = (), None
            return pruned(search, base.effects, other)
    return found


def simplest_of_each(good: list[Fit], taken: Sequence[Fit] = ()) -> list[Fit]:
    """Return the fits whose last effect contains no other's, nor is contained in or is the last one of those taken.

    A search goes from an effect to one that contains it, and back, by itself.
    """
    names = {one.effects[-1] for one in good}
    gone = {name for one in taken for name in (one.effects[-1], *BY_NAME[one.effects[-1]].simpler)}
    return [
        one
        for one in good
        if one.effects[-1] not in gone and not names & set(BY_NAME[one.effects[-1]].simpler)
    ]


def confirmed(search: Search, short: Fit, long: Fit) -> Fit:
    """Return the fit over the long horizon when what it has added shows over the short one, too; else the short one.

    Near upright an error of the start grows over a second until any effect that bends it seems to
    help.
    """
    added = [name for name in long.effects if name not in short.effects]
    if not added:
        return long
    near = seen_from(search, long, short.parts)
    shows = all(judge.distance(near, name, short.effects) > 1.0 for name in added)
    return long if shows and judge.lead(near, short).ratio > 1.0 else short


def over_whole_windows(search: Search, one: Fit) -> Fit:
    """Return a fit with its errors on the choosing windows taken over whole windows, nothing fitted anew."""
    whole = refined(search.case.problem(search.split.choose), one.theta)
    return replace(one, window_squares=whole.squares, counts=whole.counts, parts=1)


def with_pole_effects(search: Search, base: Fit) -> Fit:
    """Return the base with the effects that the pole shows by itself, its axis moved as recorded.

    The whole rig has to confirm them: they are expected there, and pruned like any other.
    """
    case = put_pole_on_moving_axis(search.case, base.theta)
    if case is None:
        return base
    held = tuple(
        name
        for name in base.effects
        if name in case.twin.effects or BY_NAME[name].place is Place.SENSOR
    )
    search.progress("asking the pole by itself, its axis moved as recorded")
    alone = Search(
        case,
        split(case.signals, case.state),
        lambda line: search.progress(f"the pole by itself: {line}"),
    )
    theta = make_theta(
        replace(
            case.twin,
            effects={n: {} if not BY_NAME[n].parameters else case.twin.effects[n] for n in held},
        )
    )
    first = fit(case, alone.split, held, theta, base.parts)
    found = pruned(alone, first.effects, grown(alone, first))
    search.pole = PoleAlone(alone, first, found)
    search.expected = tuple(name for name in found.effects if name not in held)
    if not search.expected:
        return base
    theta = base.theta.copy()
    for name in search.expected:
        theta[SLOTS[name]] = found.theta[SLOTS[name]]
    return search.fitted((*base.effects, *search.expected), base, theta)


def pruned(search: Search, kept: tuple[str, ...], best: Fit) -> Fit:
    """Return the fit without those effects, beyond the kept, that it does not need: left out, or made simpler.

    Taking one away changes what the others are needed for, so the question is asked until nothing
    goes any more.
    """
    for name in [e for e in best.effects if e not in kept and BY_NAME[e].parameters]:
        others = [n for n in best.effects if n != name]
        smaller = [
            tuple(others),
            *((*others, s) for s in BY_NAME[name].simpler if s not in others),
        ]
        for effects in smaller:
            one = search.fitted(effects, best, without(best, name, effects))
            needed = judge.needed(best, one, name, name in search.expected)
            search.note(one, f"worse without {name}" if needed else f"as good without {name}")
            if not needed:
                return pruned(search, kept, one)
    return best


def without(best: Fit, name: str, effects: tuple[str, ...]) -> Floats:
    """Return the fit's words with an effect taken out; one put in its place starts from the parameters of its name."""
    theta = best.theta.copy()
    new = [BY_NAME[one] for one in effects if one not in best.effects]
    for one in new:
        hand_over(theta, BY_NAME[name], one)
    theta[SLOTS[name]] = get_neutral_values(BY_NAME[name])
    return theta


@dataclass(frozen=True)
class Named:
    """Say of one effect found: how far the fit is ahead of one without it, and what would do as well in its place."""

    effect: str
    lead: judge.Lead
    rivals: tuple[str, ...]


def named(search: Search, base: Fit, best: Fit) -> tuple[Named, ...]:
    """Return every effect found beyond the given ones, the wrong sign first, with its rivals on this recording."""
    found = []
    for name in [e for e in best.effects if e not in search.case.twin.effects]:
        if name in base.effects:
            found.append(Named(name, judge.Lead(np.inf, np.inf), ()))
        elif search.pole is not None and name in search.expected:
            found.append(_asked_again(search.pole.search, search.pole.best, name))
        else:
            found.append(_asked_again(search, best, name))
    return tuple(found)


def _asked_again(search: Search, best: Fit, name: str) -> Named:
    effects = tuple(n for n in best.effects if n != name)
    less = search.fitted(effects, best, without(best, name, effects))
    different = [
        one for one in propose(search.case, search.split, less) if not related(one.effect, name)
    ]
    others = [
        (one.effect, search.fitted(one.effects, less, one.theta)) for one in different[:RIVALS]
    ]
    rivals = tuple(
        effect
        for effect, one in others
        if judge.needed(one, less, effect) and not judge.lead(best, one).real
    )
    for effect, one in others:
        search.note(
            one, f"{'as good as' if effect in rivals else 'worse than'} {name} in its place"
        )
    return Named(name, judge.lead(best, less), rivals)


def related(one: str, other: str) -> bool:
    """Return whether an effect is another one, contains it as a special case or becomes it at an end of its range."""
    return one == other or other in BY_NAME[one].simpler or other in BY_NAME[one].becomes
