"""Measure what no name explains, and ask the names again beside the measured laws."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace

from pendulum_sysid import decisions
from pendulum_sysid.finding.cancellation import list_cancelled
from pendulum_sysid.finding.environments import Steadiness, measure_steadiness
from pendulum_sysid.finding.given_twin import is_surely_behind
from pendulum_sysid.finding.intervals import join_intervals, limit_sizes
from pendulum_sysid.finding.localisation.inspection import inspect_twin
from pendulum_sysid.finding.localisation.localise import localise
from pendulum_sysid.finding.localisation.shape_check import (
    WrongShape,
    find_wrong_shapes,
    measure_remainders,
)
from pendulum_sysid.finding.naming import (
    Named,
    add_readings,
    has_parameters_of_rig,
    is_left_parts,
    list_doubted,
    part_sure_names,
)
from pendulum_sysid.finding.replication import widen_intervals
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.finding.whole_windows import measure_whole_windows
from pendulum_sysid.fitting.noise_floor import is_at_noise, measure_noise_floor
from pendulum_sysid.fitting.window_runs import run_parts
from pendulum_sysid.measuring.best_laws import Starts, measure_best_laws
from pendulum_sysid.measuring.explaining_names import list_explaining
from pendulum_sysid.measuring.law_bands import widen_bands
from pendulum_sysid.measuring.law_parts import give_parts_back
from pendulum_sysid.measuring.law_start import begin_laws, leave_effects_out
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.names_beside_laws import (
    is_part_of_law,
    leave_out_names,
    list_bent,
    list_lesser_parts,
    list_needed,
    list_sized,
    list_stand_ins,
)
from pendulum_sysid.measuring.penalised_fit import LawFit
from pendulum_sysid.measuring.rivals_beside_laws import ask_rivals_again
from pendulum_sysid.measuring.shared_parameters import list_shared_parameters
from pendulum_sysid.records import Fit, Outcome, Split
from pendulum_sysid.telling.likeness import is_unlike
from pendulum_sysid.telling.outcome import (
    Findings,
    decide_outcome,
    is_above_noise,
    is_motion_effect,
    is_slight,
)
from pendulum_twin.effects import BY_NAME as EFFECTS
from pendulum_twin.laws import BY_NAME as LAWS_BY_NAME

Progress = Callable[[str], None]


def measure_rest(findings: Findings, split: Split, progress: Progress) -> Measured | None:
    """Return measured laws for what no name explains; None where laws do not help.

    Laws are asked where errors remain over short windows, or over whole windows alone.
    Where names do not explain the errors, laws are tried without these names first, but beside
    the dry friction of the best fit and what the pole steadily shows by itself. Effects that take
    each other back are no names, and laws are tried without them first, too: where the recording
    never was they add up. Where no law helps, laws are tried without all effects that may be
    there.
    """
    unnamed = decide_outcome(findings) is Outcome.NOT_IN_CATALOGUE
    rest = unnamed or is_above_noise(findings) or is_slight(findings)
    if not (decisions.MEASURE_LAWS and rest and findings.change is None):
        return None
    progress(Stage.LAWS)
    shown = {e.effect for e in (*findings.named, *findings.perhaps) if e.is_of_pole}
    best = findings.best
    bare = begin_laws(findings.base, best, shown)
    cancelled = [
        effect.effect
        for effect in findings.perhaps
        if effect.is_cancelled and effect.effect not in bare.effects
    ]
    doubtful = [
        e.effect for e in findings.perhaps if e.effect in best.effects and not e.is_of_pole
    ]
    fits = (leave_effects_out(best, cancelled), best)
    starts = Starts(
        (bare, *fits) if unnamed else fits,
        tuple(e.effect for e in findings.named if is_motion_effect(e.effect)),
        tuple(cancelled),
        leave_effects_out(best, doubtful) if doubtful else None,
    )
    measured = measure_best_laws(findings.case, split, starts, progress)
    if measured is None:
        return None
    measured = give_parts_back(measured, best.effects)
    return measured if measured.law_fit.curves else None  # all of them may be parts of names


def add_laws(findings: Findings, split: Split, measured: Measured) -> Findings:
    """Return the findings with measured laws, where the laws stand.

    A name that the laws leave without a sure size, or can do without, is no name any more. Names
    and their shapes are asked again beside the laws, which hold what disturbed them before. Laws
    with which the recording still does not look like its rig go, where they explain no more than
    half of the error: they follow what is random.
    """
    case, fit = findings.case, measured.named[0]
    floor = measure_noise_floor(replace(case, twin=fit.twin), fit.theta, split.held_out)
    fit, at_noise = widen_intervals(case, split, fit), is_at_noise(case, split, fit, floor)
    steady = measure_steadiness(case, split, fit)
    explaining = find_explaining(findings, measured, fit, steady)
    joined = join_intervals(fit, findings.best, list_doubtful_sizes(measured, at_noise))
    bounded = limit_sizes(joined, fit, explaining, case.scales)
    sure, perhaps, needed = ask_names_again(findings, measured, bounded, steady, explaining)
    named = explaining.keys() & {effect.effect for effect in sure}
    fit = limit_sizes(joined, fit, named, case.scales)
    wrong_shapes = ask_shapes_again(findings, fit, sure, needed, measured.kinds)
    fit, sure = add_readings(case, fit, sure)
    improved = replace(case, twin=fit.twin)
    after = run_parts(improved, split)
    with_laws = replace(
        findings,
        named=sure,
        perhaps=perhaps,
        wrong_shapes=wrong_shapes,
        laws=widen_bands(measured),
        with_laws=fit,
        needed=needed if at_noise else (),
        after=after,
        remains=localise(inspect_twin(case, fit.theta), fit.theta, after["train"]),
        floor=measure_noise_floor(improved, fit.theta, split.held_out),
        law_misfits=measure_whole_windows(case, split, fit),
        given_stays=False,
    )
    if is_surely_behind(after["held_out"], findings.before["held_out"]):
        return findings
    left = (after["held_out"].score / findings.after["held_out"].score) ** 2
    explains = left < 1.0 - decisions.LEAST_EXPLAINED_SHARE
    return with_laws if explains or not is_unlike(with_laws) else findings


def list_doubtful_sizes(measured: Measured, at_noise: bool) -> Collection[str]:
    """Return the parameters that are known no better with measured laws than without.

    A single law that explains all errors is an explanation, as a name is. It leaves in doubt only
    the parameters of which it can hold a share. Several laws, or a law that leaves errors, are a
    choice among laws, and every parameter takes what the choice leaves.
    """
    if at_noise and len(measured.kinds) == 1:
        return list_shared_parameters(measured.case, measured.law_fit)
    return measured.named[0].estimates


def find_explaining(
    findings: Findings, measured: Measured, fit: Fit, steady: Mapping[str, Steadiness]
) -> dict[str, LawFit]:
    """Return the effects that were no names and explain most of the errors beside the laws.

    By the effect's name: the fit with the same laws without the effect (`list_explaining`). An
    effect is steady beside the laws; an effect without a size, which no environment can show, is
    in nearly all sets that predict as well.

    fit: with laws, and with intervals of its own.
    steady: the steadiness of each effect in it that has a size.
    """
    believed = {effect.effect for effect in list_doubted(findings.perhaps)}
    doubted = [
        effect.effect
        for effect in findings.perhaps
        if not (effect.is_rounding or is_part_of_law(measured, effect.effect))
        and has_parameters_of_rig(effect.effect)
    ]
    lasting = [
        name
        for name in doubted
        if (steady[name].is_steady if name in steady else name in believed)
    ]
    return list_explaining(measured, fit, lasting)


def ask_names_again(
    findings: Findings,
    measured: Measured,
    fit: Fit,
    steady: Mapping[str, Steadiness],
    explaining: Mapping[str, LawFit],
) -> tuple[tuple[Named, ...], tuple[Named, ...], tuple[str, ...]]:
    """Return the names beside laws, the effects that are none, and those that the twin needs.

    An effect that was not sure without laws is a name if it is sure, needed and steady with them,
    and no part of a law. An effect that explains most of what the laws leave without it need not
    be found again, nor believed, without laws. No name is an effect that the twin does not need
    beside the laws, that stands for another law, or that, above the noise, other effects nearly
    cancel. What could stand in the place of a name is asked again, too (`ask_rivals_again`).

    measured: the laws.
    fit: the fit with laws, with the intervals that the verdict tells.
    steady: the steadiness of each effect in it.
    explaining: fits without the effects that explain most, see `find_explaining`.
    """
    case = findings.case
    believed = {effect.effect for effect in list_doubted(findings.perhaps)} | explaining.keys()
    whole = [
        effect
        for effect in findings.perhaps
        if effect.effect in believed and not is_part_of_law(measured, effect.effect)
    ]
    doubtful, _ = part_sure_names(fit, whole, case.scales)
    bent = list_bent(measured, [effect.effect for effect in findings.named])
    sure, doubted = part_sure_names(fit, findings.named, case.scales, bent)
    names = [effect.effect for effect in (*sure, *doubtful)]
    lesser, sized = list_lesser_parts(measured, names), list_sized(measured, names)
    unknown = [name for name in sized if name not in explaining]
    known = {name: explaining[name] for name in sized if name in explaining}
    without = {**leave_out_names(measured, unknown), **known}
    needed = list_needed(measured, without)
    sure, doubtful = (
        tuple(replace(e, steadiness=steady.get(e.effect, e.steadiness)) for e in effects)
        for effects in (sure, doubtful)
    )
    above = fit.choose > decisions.MISFIT_AT_NOISE
    stand_ins = list_stand_ins(measured, {name: without[name] for name in needed})
    cancelled = list_cancelled(case, fit) if above else ()
    refuted = {*lesser, *stand_ins, *cancelled, *(name for name in sized if name not in needed)}
    idle = tuple(e for e in sure if e.effect in refuted)
    regained = tuple(
        replace(e, is_sure=True, is_cancelled=False, lacks_size=False)
        for e in doubtful
        if e.effect in needed
        and (e.is_steady or e.effect in explaining)
        and e.effect not in refuted
    )
    back = {effect.effect for effect in regained}
    return (
        ask_rivals_again(measured, (*(e for e in sure if e not in idle), *regained)),
        (*idle, *doubted, *(e for e in findings.perhaps if e.effect not in back)),
        needed,
    )


def ask_shapes_again(
    findings: Findings,
    fit: Fit,
    named: Sequence[Named],
    needed: Collection[str],
    kinds: Collection[str],
) -> tuple[WrongShape, ...]:
    """Return the wrong shapes that laws at other places than the name's do not take away.

    Those of effects that only laws made names are among them.

    fit: with laws.
    named: the effects of the fit that are asked, as they are beside the laws.
    needed: effects without which the fit with laws is worse.
    kinds: of the laws.

    A law at the place of an effect may have bent its shape to what is there, unless it leaves the
    effect its parts, or the twin needs the effect beside it at the same size everywhere.
    """
    names = [effect.effect for effect in named]
    lasting = {e.effect for e in named if e.effect in needed and e.is_steady}
    before = {effect.effect for effect in findings.named}
    if not findings.wrong_shapes and before.issuperset(names):
        return ()
    remainders = measure_remainders(findings.case, fit)
    shapes = find_wrong_shapes(findings.case, fit.theta, remainders, names)
    still = {(wrong.effect, wrong.place) for wrong in shapes}
    places = {LAWS_BY_NAME[name].place for name in kinds}
    kept = (
        wrong
        for wrong in findings.wrong_shapes
        if (wrong.effect, wrong.place) in still
        or (
            EFFECTS[wrong.effect].place in places
            and wrong.effect not in lasting
            and not is_left_parts(wrong.effect, kinds)
        )
    )
    return (*kept, *(wrong for wrong in shapes if wrong.effect not in before))
