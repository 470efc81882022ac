"""The verdict, put together from what the stages found."""

from __future__ import annotations

import math

import numpy as np
from scipy.special import ndtr

from pendulum_sysid import decisions
from pendulum_sysid.cleaning.encoder_steps import find_encoder_step
from pendulum_sysid.finding.detectors import Reading
from pendulum_sysid.finding.search import Named
from pendulum_sysid.fitting.window_runs import WindowRuns
from pendulum_sysid.measuring.naming import NamedCurve
from pendulum_sysid.records import Estimate, Fit, Localisation, Outcome, Recording
from pendulum_sysid.telling.contradictions import describe_contradictions
from pendulum_sysid.telling.events import Events, list_events
from pendulum_sysid.telling.given_values import compare_constants, compare_effect_parameters
from pendulum_sysid.telling.law_text import list_units, write_formula, write_sentence
from pendulum_sysid.telling.likeness import (
    compute_fit,
    compute_floors,
    is_unexplained,
    is_unlike,
)
from pendulum_sysid.telling.outcome import (
    Findings,
    compute_explained_share,
    compute_random_share,
    decide_outcome,
    is_above_noise,
    is_motion_effect,
    list_certain,
    list_inseparable,
    list_told,
    runs_at_noise,
)
from pendulum_sysid.telling.sentences import describe_effect, describe_masking, write_answer
from pendulum_sysid.telling.visited import Range, measure_visited
from pendulum_sysid.verdict.record import (
    BelievedSet,
    Correlations,
    EffectParameter,
    Location,
    MeasuredLaw,
    MissingEffect,
    NextExperiment,
    RecordingFacts,
    VariableShare,
    Verdict,
)
from pendulum_sysid.verdict.scores import (
    BeforeAfter,
    FitScores,
    Remainder,
    Repeats,
    WanderingForce,
)
from pendulum_twin.effects import BY_NAME
from pendulum_twin.laws.kind import EVIDENCE_NAMES, Role

CORRELATION_DIGITS = 5
NEXT_FILE = "next.yaml"
MULTIPLIED = {  # the variable that a law's value is multiplied by, beside the law's own variable
    Role.GAIN: "command",
    Role.CART_DRAG: "cart_velocity",
    Role.CART_DRY: "cart_velocity",
    Role.CART_HYSTERESIS: "cart_velocity",
    Role.CART_ONE_WAY: "cart_velocity",
    Role.POLE_DRAG: "pole_rate",
    Role.POLE_DRY: "pole_rate",
    Role.POLE_HYSTERESIS: "pole_rate",
    Role.POLE_ONE_WAY: "pole_rate",
}


def make_verdict(findings: Findings, recording: Recording, elapsed_s: float) -> Verdict:
    """Return the verdict on a recording that could be used."""
    outcome, closest = decide_outcome(findings), list_told(findings)
    events = list_events(findings)
    unlike_rig = is_unlike(findings) and events is None and findings.change is None
    remains = is_unlike(findings) or is_unexplained(findings)
    if unlike_rig or (outcome is Outcome.NOTHING_MISSING and remains):
        outcome = Outcome.NOT_IN_CATALOGUE  # far above the noise, and no effect was found for it
    events = events if outcome is Outcome.NOT_IN_CATALOGUE else None
    named = () if unlike_rig else closest  # a name for the motion of another rig is none
    names = {effect.effect for effect in named}
    readings = () if unlike_rig else list_certain(findings, closest)
    certain = tuple(describe_certain(reading) for reading in readings)
    names |= {effect.effect for effect in certain}
    # by the fit, or by a detector
    estimated = {*findings.improved.effects, *(effect.effect for effect in closest)}
    others = tuple(
        effect
        for effect in (*findings.named, *findings.perhaps)
        if effect.effect not in names and effect.effect in estimated
    )
    plan, why = findings.coming.plan, findings.coming.why
    return Verdict(
        outcome=outcome,
        sentence=write_answer(outcome, closest, certain, findings, events),
        location=_locate(outcome, named, findings, events),
        missing_physics=(*(_describe_missing(effect, findings) for effect in named), *certain),
        rig_parameters=compare_constants(findings),
        effect_parameters=compare_effect_parameters(findings),
        correlations=_name_correlations(findings.improved, findings.best),
        masking=describe_masking(named, findings),
        warnings=describe_contradictions(findings),
        perhaps=tuple(_describe_missing(effect, findings) for effect in others),
        sets=tuple(
            BelievedSet(s.effects, round(s.weight, 4))
            for s in findings.sets
            if s.weight >= decisions.SET_LEAST_WEIGHT
        ),
        fit=_score_fit(findings),
        remainder=_describe_remainder(findings),
        data_quality=recording.findings,
        next_experiment=None if plan is None else NextExperiment(NEXT_FILE, why),
        recording=_describe_recording(recording, measure_visited(findings.case)),
        elapsed_s=elapsed_s,
        measured_laws=tuple(describe_law(law) for law in findings.laws),
        unlike_rig=unlike_rig,
        given_stays=findings.given_stays,
        rig_changed=findings.change is not None and events is None,
        twin=findings.improved.twin,
        localisation=findings.location,
        next_plan=plan,
        events_s=() if events is None else events.intervals_s,
    )


def _name_correlations(final: Fit, best: Fit) -> Correlations:
    """Return the correlations of the improved twin, or those of its effects without the laws."""
    fit = final if len(final.correlations) else best
    names = tuple(fit.estimates)[: len(fit.correlations)]
    rows = np.round(fit.correlations, CORRELATION_DIGITS).tolist()
    return Correlations(names, tuple(tuple(row) for row in rows))


def make_unusable(recording: Recording, why: str, elapsed_s: float) -> Verdict:
    """Return the verdict on a recording that cannot answer the question.

    why: the reason, one sentence for a person.
    elapsed_s: duration of the diagnosis, s.
    """
    return Verdict(
        outcome=Outcome.UNUSABLE,
        sentence=why,
        location=None,
        missing_physics=(),
        rig_parameters={},
        masking=(),
        fit=None,
        remainder=None,
        data_quality=recording.findings,
        next_experiment=None,
        recording=_describe_recording(recording),
        elapsed_s=elapsed_s,
    )


def _locate(
    outcome: Outcome, named: tuple[Named, ...], findings: Findings, events: Events | None
) -> Location | None:
    """Return where the twin is wrong: the place of the effect with the largest lead, if any.

    Of events the location has the times, and as its place that of the errors there.
    """
    if outcome is Outcome.NOTHING_MISSING:
        return None
    measured: Localisation = findings.location
    place = findings.laws[0].curve.kind.place.value if findings.laws else measured.place
    physics = [effect for effect in named if is_motion_effect(effect.effect)] or list(named)
    if physics and outcome is not Outcome.NOT_IN_CATALOGUE:
        place = BY_NAME[max(physics, key=lambda effect: effect.lead.ratio).effect].place.value
    evidence = tuple(
        VariableShare(e.variable, e.finding, round(e.share, 4)) for e in measured.evidence
    )
    return Location(place, evidence, events.intervals_s if events else measured.intervals_s)


def _describe_missing(named: Named, findings: Findings) -> MissingEffect:
    """Return the entry of a named effect.

    The confidence follows from the effect's lead over a fit without it. Effects that fit as well
    share it, and it is lower while much of the error is unexplained.
    """
    effect, best = BY_NAME[named.effect], findings.improved
    most = decisions.MOST_LEAD_STANDARD_ERRORS
    lead = most if named.lead.likely else min(named.lead.standard_errors, most)
    confidence = float(ndtr(lead)) / (1 + len(named.inseparable_from))
    if is_above_noise(findings) and is_motion_effect(named.effect):
        confidence *= compute_explained_share(findings)
    parameters = {
        p.name: _make_parameter(best.estimates[f"{named.effect}.{p.name}"], p.unit)
        for p in effect.parameters
    }
    return MissingEffect(
        named.effect,
        list_inseparable(named, findings),
        round(confidence, 4),
        parameters,
        describe_effect(named.effect, best),
        None if named.replication is None else str(named.replication),
        None if named.weight is None else round(named.weight, 4),
    )


def describe_certain(reading: Reading) -> MissingEffect:
    """Return the entry of an effect that is certain although something else has no name."""
    effect = BY_NAME[reading.effect]
    units = {parameter.name: parameter.unit for parameter in effect.parameters}
    values = {
        name: f"{estimate.value:.3g} {units[name]}" for name, estimate in reading.estimates.items()
    }
    return MissingEffect(
        effect.name,
        reading.inseparable_from,
        decisions.CERTAIN_CONFIDENCE,
        {
            name: _make_parameter(estimate, units[name])
            for name, estimate in reading.estimates.items()
        },
        effect.sentence.format(**values),
    )


def _make_parameter(estimate: Estimate, unit: str) -> EffectParameter:
    return EffectParameter(float(estimate.value), float(estimate.low), float(estimate.high), unit)


def _score_fit(findings: Findings) -> FitScores:
    before, after = findings.before, findings.after
    train, held_out = (
        BeforeAfter(float(before[group].score), float(after[group].score))
        for group in ("train", "held_out")
    )
    return FitScores(
        train=train,
        held_out=held_out,
        held_out_cart_mm=_compare_joint(0, 1e3, before["held_out"], after["held_out"]),
        held_out_pole_rad=_compare_joint(1, 1.0, before["held_out"], after["held_out"]),
        held_out_cart_fit=_compare_fit(0, before["held_out"], after["held_out"]),
        held_out_pole_fit=_compare_fit(1, before["held_out"], after["held_out"]),
        floors=compute_floors(findings),
        noise_floor=math.nan if findings.floor is None else float(findings.floor.score),
    )


def _compare_joint(
    joint: int, scale: float, before: WindowRuns, after: WindowRuns
) -> BeforeAfter | None:
    old, new = (runs.of_joint(joint, runs.rmse) for runs in (before, after))
    return None if old is None or new is None else BeforeAfter(old * scale, new * scale)


def _compare_fit(joint: int, before: WindowRuns, after: WindowRuns) -> BeforeAfter | None:
    old, new = (runs.of_joint(joint, compute_fit(runs)) for runs in (before, after))
    return None if old is None or new is None else BeforeAfter(100.0 * old, 100.0 * new)


def describe_law(named: NamedCurve) -> MeasuredLaw:
    """Return the entry of a measured law."""
    kind, unit = named.curve.kind, named.curve.kind.quantity.unit
    variables = [EVIDENCE_NAMES[kind.variable]]
    if kind.role in MULTIPLIED:
        variables.append(MULTIPLIED[kind.role])
    half = decisions.INTERVAL_DEVIATIONS
    shape = named.shape
    parameters = {}
    if shape is not None:
        units = list_units(shape.shape, kind)
        parameters = {
            name: EffectParameter(
                float(value), float(value - half * wide), float(value + half * wide), units[name]
            )
            for name, value, wide in zip(shape.names, shape.values, shape.deviations, strict=True)
        }
    return MeasuredLaw(
        law=kind.name,
        place=kind.place.value,
        variables=tuple(variables),
        knots=tuple(named.curve.knots.tolist()),
        values=tuple(named.values.tolist()),
        low=tuple((named.values - named.band).tolist()),
        high=tuple((named.values + named.band).tolist()),
        unit=unit,
        formula=write_formula(named),
        sentence=write_sentence(named),
        shape=shape.shape.name if shape is not None else "",
        parameters=parameters,
        effective_parameters=named.effective,
    )


def _describe_remainder(findings: Findings) -> Remainder | None:
    if runs_at_noise(findings):
        return None
    evidence = findings.remains.evidence
    finding = "depends on no variable that was asked"
    if evidence:
        finding = f"{evidence[0].variable}: {evidence[0].finding}"
    ratio = compute_floors(findings).after
    repeats, wandering = _describe_repeats(findings), _describe_wandering(findings)
    whole = float(max(findings.whole_misfits))
    return Remainder(findings.remains.place, ratio, finding, repeats, wandering, max(whole, 1.0))


def _describe_wandering(findings: Findings) -> WanderingForce | None:
    signals, force = findings.case.signals, findings.wandering
    if force is None:
        return None
    return WanderingForce(
        None if signals.cart is None else float(force.force_n),
        None if signals.pole is None else float(force.torque_n_m),
        float(force.correlation_s),
        compute_random_share(findings),
    )


def _describe_repeats(findings: Findings) -> Repeats | None:
    measured, floor = findings.repeats, findings.floor
    if measured is None or floor is None:
        return None
    floors = max(measured.random / floor.typical, 1.0)
    return Repeats(measured.share, measured.low, measured.high, measured.windows, floors)


def _describe_recording(
    recording: Recording, visited: dict[str, Range] | None = None
) -> RecordingFacts:
    signals = recording.signals
    return RecordingFacts(
        name=recording.name,
        seconds=signals.seconds,
        samples=len(signals),
        rate_hz=1.0 / signals.period_s,
        digest=recording.digest,
        position_step_m=find_encoder_step(signals.cart),
        angle_step_rad=find_encoder_step(signals.pole),
        visited=visited or {},
    )
