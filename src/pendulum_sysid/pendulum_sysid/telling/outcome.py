"""The rules by which the findings of the stages end in one of the outcomes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from pendulum_sysid import decisions
from pendulum_sysid.finding.changed_rig import ChangedRig
from pendulum_sysid.finding.detectors import Reading
from pendulum_sysid.finding.localisation.shape_check import WrongShape
from pendulum_sysid.finding.search import Named
from pendulum_sysid.finding.separation import Tie, find_stand_in
from pendulum_sysid.finding.weights import WeighedSet
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.noise_floor import NoiseFloor
from pendulum_sysid.fitting.parameters import list_rig_parameters
from pendulum_sysid.fitting.predictions import LatentForce
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.measuring.naming import NamedCurve
from pendulum_sysid.measuring.repeatability import Repeatability
from pendulum_sysid.records import Fit, Localisation, Next, Outcome
from pendulum_twin.arrays import Floats
from pendulum_twin.effects import BY_NAME, CATALOGUE
from pendulum_twin.effects.effect import Form, Place

NOT_PLANNED = Next(None, "")


@dataclass(frozen=True)
class Findings:
    """Hold what the stages of a diagnosis return.

    case: the recording and the twin as given.
    base: fit of the rig's constants alone.
    best: fit of constants and effects, without measured laws.
    named: effects of the best fit that the given twin lacks.
    location: what the errors of the base fit depend on.
    remains: what the errors of the improved twin depend on.
    before, after: free runs of the given and of the improved twin, by "train", "learn" (all
        windows that are not held out) and "held_out".
    floor: what a perfect model reaches on this recording; None where that cannot be measured.
    wrong_shapes: named effects whose law does not have the shape that is seen.
    learned_misfit: of the best fit over windows of full length, their start states fitted.
    held_out_misfit: the same of the windows that are left out.
    law_misfits: both of the fit with measured laws; None without laws.
    perhaps: effects of the best fit that are not sure enough to be named.
    sets: the sets of effects that were tried, and how much each is believed.
    certain: what detectors are certain of, asked only where the rest has no name.
    laws: measured laws of the improved twin, for what has no name.
    with_laws: fit of constants, effects and these laws; None without laws.
    needed: named effects that the twin needs beside laws that bring it to the noise.
    repeats: how much of the improved twin's error comes again; None where no motion does.
    wandering: the force that would make up for what the improved twin lacks; None at the noise.
    given_stays: True where no other twin runs left-out windows better for sure: the improved twin
        is the given twin then.
    base_runs: free runs of the constants alone, over windows one after another; None if not asked.
    change: how the rig changed between its recordings; None where nothing says so.
    ties: effects of the best fit that another effect could stand for.
    coming: plan of the next experiment.
    """

    case: Case
    base: Fit
    best: Fit
    named: tuple[Named, ...]
    location: Localisation
    remains: Localisation
    before: dict[str, WindowRuns]
    after: dict[str, WindowRuns]
    floor: NoiseFloor | None
    wrong_shapes: tuple[WrongShape, ...] = ()
    learned_misfit: float = 1.0
    held_out_misfit: float = 1.0
    law_misfits: tuple[float, float] | None = None
    perhaps: tuple[Named, ...] = ()
    sets: tuple[WeighedSet, ...] = ()
    certain: tuple[Reading, ...] = ()
    laws: tuple[NamedCurve, ...] = ()
    with_laws: Fit | None = None
    needed: tuple[str, ...] = ()
    repeats: Repeatability | None = None
    wandering: LatentForce | None = None
    given_stays: bool = False
    base_runs: WindowRuns | None = None
    change: ChangedRig | None = None
    ties: tuple[Tie, ...] = ()
    coming: Next = NOT_PLANNED

    @property
    def improved(self) -> Fit:
        """Return the fit of the improved twin: with measured laws, or else the best fit."""
        return self.with_laws or self.best

    @property
    def bands(self) -> dict[str, Floats]:
        """Return measured law -> (knots,) half widths of its band, in the unit of its values."""
        return {law.curve.kind.name: law.band for law in self.laws}

    @property
    def whole_misfits(self) -> tuple[float, float]:
        """Return the misfits of the improved twin over whole windows, learned on and held out."""
        return self.law_misfits or (self.learned_misfit, self.held_out_misfit)


def decide_outcome(findings: Findings) -> Outcome:
    """Return how the diagnosis ends: the first of these rules that holds.

    1. `not_in_catalogue`: a name does not have the shape of its law; or errors above the noise
       remain, over windows or over whole windows, and the names explain too little of them.
    2. `ambiguous`: this recording cannot tell a named effect of the motion from another effect.
    3. `named`: an effect was found.
    4. `nothing_missing`.
    """
    physics = [effect for effect in findings.named if is_motion_effect(effect.effect)]
    if findings.wrong_shapes or explains_too_little(findings):
        return Outcome.NOT_IN_CATALOGUE
    if any(effect.inseparable_from for effect in physics):
        return Outcome.AMBIGUOUS
    return Outcome.NAMED if findings.named else Outcome.NOTHING_MISSING


def explains_too_little(findings: Findings) -> bool:
    """Return whether errors remain of which the named effects explain too little.

    What the best fit holds but cannot name explains nothing.
    """
    share = compute_explained_share(findings) if findings.named else 0.0
    little = share < decisions.LEAST_EXPLAINED_SHARE
    return little and (is_above_noise(findings) or is_slight(findings))


def list_told(findings: Findings) -> tuple[Named, ...]:
    """Return the named effects that the verdict tells.

    Where something else has no name, an effect of the motion is told only if the twin needs it
    beside laws that bring it to the noise; or if its law has the shape that is seen, and either
    its size is the same wherever it could show (and no detector has measured it beside what has no
    name), or it acts at another place than what has no name and most of the error that is left
    without it is its own.
    """
    if decide_outcome(findings) is not Outcome.NOT_IN_CATALOGUE:
        return findings.named
    doubtful = {wrong.effect for wrong in findings.wrong_shapes}
    places = {BY_NAME[name].place for name in doubtful} | {
        Place(wrong.place) for wrong in findings.wrong_shapes
    }
    certain = {
        name
        for reading in findings.certain
        for name in (reading.effect, *reading.inseparable_from)
    }
    alone = explains_too_little(findings)
    return tuple(
        effect
        for effect in findings.named
        if not is_motion_effect(effect.effect)
        or effect.effect in findings.needed
        or (effect.is_steady and not (doubtful | certain) & list_like(effect))
        or (
            not alone
            and BY_NAME[effect.effect].place not in places
            and effect.lead.ratio >= decisions.CHIEF_MISFIT_RATIO
        )
    )


def list_certain(findings: Findings, named: Sequence[Named]) -> tuple[Reading, ...]:
    """Return what detectors are certain of and the names do not tell already.

    named: effects that the verdict names. What cannot be told from such an effect, and what could
    be such an effect itself, is the same physics.
    """
    names = {effect.effect for effect in named}
    known = {name for effect in named for name in list_like(effect)}
    return tuple(
        reading
        for reading in findings.certain
        if reading.effect not in known and names.isdisjoint(reading.inseparable_from)
    )


def list_like(effect: Named) -> set[str]:
    """Return an effect, what it contains, and what the recording cannot tell from it."""
    return {effect.effect, *BY_NAME[effect.effect].simpler, *effect.inseparable_from}


def is_slight(findings: Findings) -> bool:
    """Return whether whole windows show errors that their pieces hide in the noise.

    Several effects of the catalogue may each take a little of a small effect that has no name.
    """
    return decisions.CHECK_SLIGHT and findings.learned_misfit > decisions.MISFIT_AT_NOISE


def is_motion_effect(name: str) -> bool:
    """Return whether an effect changes the motion: no sign, no filter of reported velocities."""
    return bool(BY_NAME[name].parameters) and BY_NAME[name].form is not Form.REPORT


def is_above_noise(findings: Findings) -> bool:
    """Return whether the best fit leaves errors beyond the noise of the sensors."""
    return findings.best.choose > decisions.MISFIT_AT_NOISE


def compute_explained_share(findings: Findings) -> float:
    """Return the share (0 to 1) of the error's power that the named effects take away.

    The errors are those of the fit of the rig's constants alone, cross-validated.
    """
    return 1.0 - min((findings.best.choose / findings.base.choose) ** 2, 1.0)


def runs_at_noise(findings: Findings) -> bool:
    """Return whether the improved twin runs every window at the noise: then nothing remains.

    Start states are fitted, lest their noise hide an error. Near upright the error of a start
    state grows over a second until the run is far off: a run from a smoothed start then says
    nothing about the twin. The pieces of windows, over which a fit may go, hide what grows slowly:
    whole windows are asked as well, those that were learned on and those that are held out.
    """
    misfits = (findings.improved.choose, *findings.whole_misfits)
    return all(misfit <= decisions.MISFIT_AT_NOISE for misfit in misfits)


def compute_random_share(findings: Findings) -> float:
    """Return the share (0 to 1) of what remains that depends on nothing that was asked.

    What comes again with the same motion is not random, whatever it depends on.
    """
    again = 0.0 if findings.repeats is None else findings.repeats.share
    return 1.0 - max(findings.remains.explained, again)


def list_inseparable(effect: Named, findings: Findings) -> tuple[str, ...]:
    """Return the effects that this recording, or any motion at all, cannot tell from an effect."""
    rig = findings.case.twin.rig
    has_both = rig.has_cart and rig.has_pole
    constants = list_rig_parameters(findings.case.twin)
    by_no_motion = (
        other.name
        for other in CATALOGUE
        if find_stand_in(other, constants) == effect.effect
        and (has_both or not other.needs_both_joints)
    )
    return (*effect.inseparable_from, *by_no_motion)
