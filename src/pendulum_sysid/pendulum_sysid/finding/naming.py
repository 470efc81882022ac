"""Name the effects of a fit, and say which others could stand in each one's place."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from pendulum_sysid import decisions
from pendulum_sysid.finding.cancellation import list_cancelled
from pendulum_sysid.finding.detectors import Use, read_effects
from pendulum_sysid.finding.environments import Steadiness, measure_steadiness
from pendulum_sysid.finding.journal import Search
from pendulum_sysid.finding.judge import (
    Lead,
    compute_lead,
    is_most_explained,
    is_needed,
    is_outdone,
    is_surely_there,
)
from pendulum_sysid.finding.pole_alone import PoleAnswer
from pendulum_sysid.finding.propose import Proposal, propose
from pendulum_sysid.finding.pruning import fit_without_effect
from pendulum_sysid.finding.replication import Replication, replicate_effects
from pendulum_sysid.finding.separation import Tie, is_related
from pendulum_sysid.finding.weights import WeighedSet, weigh_effect
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.parameters import Scales
from pendulum_sysid.records import Fit
from pendulum_twin.effects import BY_NAME
from pendulum_twin.parameter_vector import SLOTS, get_neutral_values


@dataclass(frozen=True)
class Named:
    """Hold a named effect and the evidence for it.

    effect: its name.
    lead: how far the fit is ahead of a fit without it.
    inseparable_from: effects that do as well in its place on this recording.
    replication: in how many parts of the recordings the effect is found again; None for an effect
        that is not asked for again.
    steadiness: its size in environments in which the rig moves otherwise; None where the fit ends
        at the noise, and for an effect without a size.
    weight: how much the effect, or what it cannot be told from, is believed, 0 to 1, over all sets
        that were tried; None for an effect that no search tries.
    is_sure: False where what remains widens the intervals, over short pieces or whole windows, and
        the interval of every size holds the value at which the effect vanishes.
    is_cancelled: True where the fit leaves more than noise, and other effects nearly cancel the
        effect.
    is_of_pole: True where the pole steadily shows the effect by itself.
    is_rounding: True where the effect is no more than how the pole's encoder rounds.
    explains_most: whether the fit without the effect leaves far more errors (`is_most_explained`).
    lacks_size: True where the fit leaves more than noise, and the effect has no size to be asked
        for in environments: a limit, a step.
    rivals: fits with another effect in its place that do as well.
    """

    effect: str
    lead: Lead
    inseparable_from: tuple[str, ...] = ()
    replication: Replication | None = None
    steadiness: Steadiness | None = None
    weight: float | None = None
    is_sure: bool = True
    is_cancelled: bool = False
    is_of_pole: bool = False
    is_rounding: bool = False
    explains_most: bool = False
    lacks_size: bool = False
    rivals: tuple[Fit, ...] = field(default=(), compare=False, repr=False)

    @property
    def is_lasting(self) -> bool:
        """Return whether the effect is surely there, and at the same size wherever it shows.

        Nearly all sets that predict as well have to hold it.
        """
        lasting = self.replication is None or self.replication.is_lasting
        contradicted = self.steadiness is not None and self.steadiness.is_contradicted
        believed = self.weight is None or self.weight >= decisions.NAME_LEAST_WEIGHT
        slight = self.lacks_size and not self.explains_most
        whole = self.is_sure and not (self.is_cancelled or self.is_rounding or slight)
        return whole and lasting and not contradicted and believed

    @property
    def is_steady(self) -> bool:
        """Return whether the effect is surely there wherever it could show."""
        return self.steadiness is not None and self.steadiness.is_steady


def name_effects(
    search: Search, base: Fit, best: Fit, pole: PoleAnswer | None = None
) -> tuple[Named, ...]:
    """Return every effect that a fit holds beyond the given twin's, a wrong sign first.

    base: the fit of parameters alone, with the wrong sign.
    best: the fit with all effects.
    pole: what the pole shows by itself; its effects are asked about there.
    """
    named = []
    for name in [e for e in best.effects if e not in search.case.twin.effects]:
        if name in base.effects:
            named.append(Named(name, Lead(np.inf, np.inf)))
        elif pole is not None and name in pole.effects:
            shown = _exchange_and_compare(pole.search, pole.best, name)
            # constants of the pole by itself are no constants of the rig: no rival's intervals
            named.append(replace(shown, is_of_pole=name in pole.steady, rivals=()))
        else:
            named.append(_exchange_and_compare(search, best, name))
    return tuple(named)


def _exchange_and_compare(search: Search, best: Fit, name: str) -> Named:
    """Return an effect of a fit with its lead, and the effects that do as well in its place.

    The likeliest rivals are asked. What does as well may do so by an effect that it contains,
    which is then asked, too.
    """
    less = fit_without_effect(search, best, name)
    search.journal.note(less, f"without {name}")
    others = [
        proposal
        for proposal in propose(search.case, search.split, less)
        if not is_related(proposal.effect, name) and proposal.effect not in search.refuted
    ]
    refitted, inseparable, rivals = others[: decisions.RIVALS_REFITTED], [], []
    for proposal in refitted:
        other = _fit_rival(search, best, less, name, proposal)
        as_good = _does_as_well(search, other, best, less, proposal.effect)
        if as_good:
            inseparable.append(proposal.effect)
            rivals.append(other)
            simpler = BY_NAME[proposal.effect].simpler
            refitted += [o for o in others if o.effect in simpler and o not in refitted]
        verdict = "as good as" if as_good else "worse than"
        search.journal.note(other, f"{verdict} {name} in its place")
    return Named(
        name,
        compute_lead(best, less),
        tuple(inseparable),
        explains_most=is_most_explained(best, less),
        rivals=tuple(rivals),
    )


def _does_as_well(search: Search, other: Fit, best: Fit, less: Fit, rival: str) -> bool:
    """Return whether a fit with a rival in the place of an effect does as well as the best fit.

    A rival behind may be right beside something without a name (`is_outdone`). Then the rival has
    to be steady, as a name above the noise has to be.

    less: the fit with neither.
    """
    if not is_needed(other, less, rival) or is_outdone(other, best):
        return False
    if not compute_lead(best, other).is_real:
        return True
    steadiness = measure_steadiness(search.case, search.split, other).get(rival)
    return steadiness is not None and steadiness.is_steady


def _fit_rival(search: Search, best: Fit, less: Fit, name: str, proposal: Proposal) -> Fit:
    """Return the fit of a rival in an effect's place, from the better of two beginnings.

    Without the effect the constants lie far off, and a fit from there may end on its way. So a
    rival that is of use and behind begins again from what the best fit says of all others.
    """
    other = search.fit_effects(proposal.effects, less, proposal.theta)
    behind = compute_lead(best, other).is_real
    if not behind or not is_needed(other, less, proposal.effect):
        return other
    theta = best.theta.copy()
    for effect in {name, *best.effects}.difference(proposal.effects):
        theta[SLOTS[effect]] = get_neutral_values(BY_NAME[effect])
    theta[SLOTS[proposal.effect]] = other.theta[SLOTS[proposal.effect]]
    again = search.fit_effects(proposal.effects, best, theta)
    return min(other, again, key=lambda fit: fit.train)


def add_ties(named: Iterable[Named], ties: Iterable[Tie]) -> tuple[Named, ...]:
    """Return the names with the effects that sensitivities cannot part from them, too."""
    others: dict[str, list[str]] = {}
    for tie in ties:
        if tie.rival is not None and not tie.by_no_motion:
            others.setdefault(tie.effect, []).append(tie.rival)
    return tuple(
        replace(
            effect,
            inseparable_from=tuple(
                dict.fromkeys((*effect.inseparable_from, *others.get(effect.effect, ())))
            ),
        )
        for effect in named
    )


def add_replications(
    search: Search, best: Fit, named: Iterable[Named], sets: Sequence[WeighedSet]
) -> tuple[Named, ...]:
    """Return the names with how often each is found again, and how much it is believed.

    A fit above the noise lacks something, and a name may stand for what it lacks: its size is
    asked in environments, too, and whether other effects nearly cancel the name. A name that has
    no such size has to explain most of the errors.
    """
    replications = replicate_effects(search.case, search.split, best)
    above = best.choose > decisions.MISFIT_AT_NOISE
    steadiness = measure_steadiness(search.case, search.split, best) if above else {}
    cancelled = list_cancelled(search.case, best) if above else frozenset()
    return tuple(
        replace(
            effect,
            replication=replications.get(effect.effect),
            steadiness=steadiness.get(effect.effect),
            weight=weigh_effect(sets, effect.effect, effect.inseparable_from),
            is_cancelled=effect.effect in cancelled,
            lacks_size=above
            and effect.effect not in steadiness
            and has_parameters_of_rig(effect.effect),
        )
        for effect in named
    )


def has_parameters_of_rig(effect: str) -> bool:
    """Return whether an effect has parameters, and belongs to the rig, not to one recording."""
    return not (BY_NAME[effect].is_switch or BY_NAME[effect].of_recording)


def doubt_intervals(
    best: Fit, widened: Fit, named: Iterable[Named], scales: Scales
) -> tuple[Named, ...]:
    """Return the names of a fit with `is_sure`: whether the intervals exclude a size of 0.

    Intervals that nothing widens exclude it already: the fit is at the noise with each effect, and
    not without.

    widened: the fit with intervals that the remainder and the parts of the recording have widened;
        the fit itself where nothing widens them.
    scales: of the recording.
    """
    return tuple(
        replace(effect, is_sure=widened is best or is_surely_there(widened, effect.effect, scales))
        for effect in named
    )


def is_left_parts(effect: str, kinds: Collection[str]) -> bool:
    """Return whether a law of one of these kinds leaves an effect its parts."""
    return bool(BY_NAME[effect].law_parts) and BY_NAME[effect].law_kind in kinds


def list_doubted(perhaps: Iterable[Named]) -> tuple[Named, ...]:
    """Return the effects that are found again and believed, among those that are not sure enough.

    Their sizes were not sure, or not the same wherever they could show.
    """
    return tuple(
        effect
        for effect in perhaps
        if not effect.is_rounding
        and (effect.replication is None or effect.replication.is_lasting)
        and effect.weight is not None
        and effect.weight >= decisions.NAME_LEAST_WEIGHT
    )


def part_sure_names(
    fit: Fit, named: Iterable[Named], scales: Scales, bent: Collection[str] = ()
) -> tuple[tuple[Named, ...], tuple[Named, ...]]:
    """Return the names of a fit with laws whose sizes are surely there, and its other names.

    Names of effects that the fit lacks are left out: others have taken their places. A name whose
    shape a law bends is not sure: the two share what is there in any way.

    scales: of the recording.
    bent: effects whose shape a law bends.
    """
    names = tuple(effect for effect in named if effect.effect in fit.effects)
    sure = tuple(
        effect
        for effect in names
        if is_surely_there(fit, effect.effect, scales) and effect.effect not in bent
    )
    return sure, tuple(effect for effect in names if effect not in sure)


def add_readings(case: Case, best: Fit, named: tuple[Named, ...]) -> tuple[Fit, tuple[Named, ...]]:
    """Return fit and names with the effects that detectors name beside them."""
    for reading in read_effects(case, best.theta, Use.NAME):
        name, lead = reading.effect, reading.lead
        assert lead is not None
        theta = best.theta.copy()
        theta[SLOTS[name]] = reading.values
        parameters = [parameter.name for parameter in BY_NAME[name].parameters]
        values = dict(zip(parameters, reading.values, strict=True))
        twin = replace(best.twin, effects={**best.twin.effects, name: values})
        own = {f"{name}.{parameter}": e for parameter, e in reading.estimates.items()}
        best = replace(best, theta=theta, twin=twin, estimates={**best.estimates, **own})
        named = (*named, Named(name, lead))
    return best, named
