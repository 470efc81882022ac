"""The stages of a diagnosis in order, from recordings to a verdict."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace

from pendulum_sysid import decisions
from pendulum_sysid.beside_laws import add_laws, measure_rest
from pendulum_sysid.cleaning.joining import join_recordings
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.finding.changed_rig import find_change, take_changed_rig
from pendulum_sysid.finding.detectors import Use, read_effects
from pendulum_sysid.finding.given_twin import find_given_twin, is_surely_behind, take_given_twin
from pendulum_sysid.finding.localisation.inspection import inspect_twins
from pendulum_sysid.finding.localisation.localise import localise
from pendulum_sysid.finding.localisation.shape_check import find_wrong_shapes, measure_remainders
from pendulum_sysid.finding.search import Answer, search_in_place
from pendulum_sysid.finding.settled_search import search_settled
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.finding.whole_windows import measure_whole_windows
from pendulum_sysid.fitting.blas_threads import use_one_blas_thread
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.latent_force import measure_latent_force
from pendulum_sysid.fitting.noise_floor import measure_noise_floor
from pendulum_sysid.fitting.window_runs import run_parts, run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut_windows
from pendulum_sysid.measuring.best_laws import is_better
from pendulum_sysid.measuring.measure import Measured
from pendulum_sysid.measuring.repeatability import measure_repeatability
from pendulum_sysid.measuring.wider_effects import find_wider_effects
from pendulum_sysid.planning.next_experiment import CHANGED, plan_next_experiment
from pendulum_sysid.prepare import Prepared, prepare
from pendulum_sysid.records import Outcome, Recording, Split
from pendulum_sysid.telling.drawings import collect_drawings, draw_overlays
from pendulum_sysid.telling.outcome import Findings, decide_outcome, is_above_noise, runs_at_noise
from pendulum_sysid.telling.verdict import make_unusable, make_verdict
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.model import Twin

Progress = Callable[[str], None]


def diagnose(recordings: Sequence[Recording], twin: Twin, progress: Progress) -> Verdict:
    """Return what recordings of one rig say about a twin of it.

    Raises WrongUse when the recordings do not fit together or hold a joint that the twin lacks; a
    recording that cannot answer ends in a verdict whose outcome is `unusable`.
    """
    began = time.monotonic()
    progress(Stage.PREPARING)
    with use_one_blas_thread():
        try:
            prepared = prepare(recordings, twin)
        except UnusableRecording as error:
            recording = error.recording or join_recordings(list(recordings))
            return make_unusable(recording, str(error), time.monotonic() - began)
        verdict = diagnose_prepared(prepared, progress, began)
    return replace(verdict, warnings=(*prepared.doubts, *verdict.warnings))


def diagnose_prepared(prepared: Prepared, progress: Progress, began: float) -> Verdict:
    """Return what prepared recordings say about their twin.

    began: monotonic time, s, at which the work on them began.
    """
    recording = prepared.case.recording
    progress(f"{recording.name}: {len(prepared.case.signals)} samples")
    case, split, answer = search_settled(prepared.case, prepared.split, progress)
    prepared = replace(prepared, case=case, split=split)
    findings = explain_answer(prepared, answer, progress)
    verdict = make_verdict(findings, case.recording, time.monotonic() - began)
    overlays = draw_overlays(findings.before["held_out"], findings.after["held_out"])
    return replace(
        verdict,
        trials=answer.journal.trials,
        overlays=overlays,
        drawings=collect_drawings(findings, prepared.split.held_out),
    )


def explain_answer(prepared: Prepared, answer: Answer, progress: Progress) -> Findings:
    """Return all that a verdict is written from: the search's answer, judged, and laws."""
    case, split = prepared.case, prepared.split
    findings = judge_answer(case, split, answer, progress)
    measured = measure_rest(findings, split, progress)
    if measured is not None:
        wider = widen_names(findings, split, answer, measured, progress)
        findings = wider or add_laws(findings, split, measured)
    findings = plan_next(findings, split)
    if runs_at_noise(findings):
        return findings
    improved = replace(case, twin=findings.improved.twin)
    findings = replace(findings, repeats=measure_repeatability(improved))
    if findings.improved.choose <= decisions.MISFIT_AT_NOISE:  # too little for the size of a force
        return findings
    wandering = measure_latent_force(improved, split, findings.improved.theta)
    return replace(findings, wandering=wandering)


def widen_names(
    findings: Findings, split: Split, answer: Answer, measured: Measured, progress: Progress
) -> Findings | None:
    """Return the findings with wider effects in the place of names, where laws ask for them.

    Laws beside a name that is too simple follow what the name lacks. So they are measured anew
    beside the wider effect, which stays where it is a name then and the twin is no worse. None
    where no wider effect stays.

    answer: what the findings judge.
    measured: laws beside the names of the findings.
    """
    case = findings.case
    wider = find_wider_effects(measured, [effect.effect for effect in findings.named])
    if not wider:
        return None
    again = judge_answer(case, split, search_in_place(case, split, answer, wider), progress)
    rest = measure_rest(again, split, progress)
    if rest is None:
        with_laws, worse = again, is_above_noise(again)
    else:
        with_laws = add_laws(again, split, rest)
        worse = with_laws is again or is_better(measured, rest, wider)
    named = {effect.effect for effect in with_laws.named}
    return None if worse or not named.issuperset(wider) else with_laws


def plan_next(findings: Findings, split: Split) -> Findings:
    """Return the findings with a next experiment for the fit that the verdict tells.

    Laws make intervals narrow. Ties are of twins without laws, and so is a plan that parts them.
    """
    if findings.change:
        return replace(findings, coming=CHANGED)
    fit, ties = findings.with_laws, findings.ties
    if fit is None or decide_outcome(findings) is Outcome.AMBIGUOUS:
        fit = findings.best
    else:
        named = {effect.effect for effect in findings.named}
        ties = tuple(tie for tie in ties if tie.by_no_motion and tie.effect in named)
    plan = plan_next_experiment(findings.case, split, fit, ties, bands=findings.bands)
    return replace(findings, coming=plan)


def judge_answer(case: Case, split: Split, answer: Answer, progress: Progress) -> Findings:
    """Return the findings of all stages after the search, from which the verdict is written.

    answer: what the search ended at; its fits are compared, on learned and on held-out windows,
        by free runs, by the missing force that each leaves, and by the noise floor.
    """
    progress(Stage.JUDGING)
    change = find_change(case, split, answer)
    if change is not None:
        answer = take_changed_rig(answer, change)
    before, after = run_parts(case, split), run_parts(replace(case, twin=answer.best.twin), split)
    behind = is_surely_behind(after["held_out"], before["held_out"])
    given = find_given_twin(case, split, answer.best, behind)
    if given is not None:
        answer = take_given_twin(answer, given)
        after = run_parts(replace(case, twin=answer.best.twin), split)
    base, best = answer.base, answer.best
    names = [named.effect for named in answer.named]
    windows = cut_windows(case.signals, case.state, WINDOW_S)
    base_runs = run_windows(replace(case, twin=base.twin), windows)
    equations, at_base = inspect_twins(case, (best.theta, base.theta))
    remainders = measure_remainders(case, best, [each.table for each in equations])
    learned_misfit, held_out_misfit = measure_whole_windows(case, split, best)
    findings = Findings(
        case=case,
        base=base,
        best=best,
        named=answer.named,
        perhaps=answer.perhaps,
        sets=answer.sets,
        location=localise(at_base, base.theta, base_runs),
        remains=localise(equations, best.theta, after["train"]),
        before=before,
        after=after,
        floor=measure_noise_floor(replace(case, twin=best.twin), best.theta, split.held_out),
        ties=answer.ties,
        wrong_shapes=tuple(find_wrong_shapes(case, best.theta, remainders, names)),
        learned_misfit=learned_misfit,
        held_out_misfit=held_out_misfit,
        given_stays=given is not None,
        base_runs=base_runs,
        change=change,
    )
    if decide_outcome(findings) is Outcome.NOT_IN_CATALOGUE:
        return replace(findings, certain=read_effects(case, base.theta, Use.CERTAIN))
    return findings
