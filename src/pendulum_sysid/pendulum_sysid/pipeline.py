"""The stages in order: recordings -> signals -> residuals -> place -> hypotheses -> fits -> verdict."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from pendulum_sysid.cleaning.joining import join_recordings
from pendulum_sysid.errors import UnusableRecording
from pendulum_sysid.finding.identifiability import ties
from pendulum_sysid.finding.judge import Lead
from pendulum_sysid.finding.localisation.localise import localise
from pendulum_sysid.finding.localisation.shape_check import misfit_of_named, outweighed, remainders
from pendulum_sysid.finding.search import (
    Named,
    Search,
    missing,
    named,
    parameters_alone,
    seen_from,
)
from pendulum_sysid.finding.separation import Tie
from pendulum_sysid.finding.steady_friction import steady_friction
from pendulum_sysid.finding.velocity_lag import EFFECT, velocity_lag
from pendulum_sysid.fitting.case import Case
from pendulum_sysid.fitting.gauss_newton import refined
from pendulum_sysid.fitting.noise_floor import noise_floor
from pendulum_sysid.fitting.window_runs import JOINTS, UNITS, WindowRuns, run_windows
from pendulum_sysid.fitting.windows import WINDOW_S, cut
from pendulum_sysid.planning.next_experiment import planned_next
from pendulum_sysid.prepare import prepare
from pendulum_sysid.records import Fit, Outcome, Overlay, Recording, Split
from pendulum_sysid.telling.outcome import Findings, decide_outcome
from pendulum_sysid.telling.verdict import make_unusable, make_verdict
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.model import Twin
from pendulum_twin.parameter_vector import SLOTS

Progress = Callable[[str], None]


def diagnose(recordings: list[Recording], twin: Twin, progress: Progress) -> Verdict:
    """Return what recordings of one rig say about a twin of it.

    Raises WrongUse when the recordings do not fit together or hold a joint that the twin
    lacks; a recording that cannot answer ends in a verdict whose outcome is `unusable`.
    """
    began = time.monotonic()
    try:
        prepared = prepare(recordings, twin)
    except UnusableRecording as error:
        recording = error.recording or join_recordings(recordings)
        return make_unusable(recording, str(error), time.monotonic() - began)
    case, parts, recording = prepared.case, prepared.split, prepared.case.recording
    search = Search(case, parts, progress)
    progress(f"{recording.name}: {len(case.signals)} samples, fitting the rig's constants alone")
    base = parameters_alone(search)
    best = missing(search, base)
    found = named(search, base, best)
    tied = ties(case, parts, best, {one.effect: one.rivals for one in found})
    found = with_ties(found, tied)
    best, found = with_velocity_lag(recording, case, best, found)
    base = base if base.parts == best.parts else seen_from(search, base, best.parts)
    improved = replace(case, twin=best.twin)
    before, after = runs_by_part(case, parts), runs_by_part(improved, parts)
    location = localise(
        case,
        base.theta,
        run_windows(replace(case, twin=base.twin), cut(case.signals, case.state, WINDOW_S)),
    )
    remains = localise(case, best.theta, after["train"])
    floor = noise_floor(improved, best.theta, parts.held_out)
    rest = remainders(case, best, base)
    misfits = tuple(misfit_of_named(case, best.theta, rest, [one.effect for one in found]))
    coming = planned_next(case, parts, best, tied)
    whole = refined(case.problem(parts.choose), best.theta).misfit(case.noise)
    heavy = outweighed(rest)
    findings = Findings(
        case,
        base,
        best,
        found,
        location,
        remains,
        before,
        after,
        floor,
        coming,
        misfits,
        heavy,
        whole,
    )
    if decide_outcome(findings) is Outcome.NOT_IN_CATALOGUE:
        findings = replace(findings, steady=steady_friction(case, base.theta))
    verdict = make_verdict(findings, recording, time.monotonic() - began)
    return replace(verdict, trials=tuple(search.trials), overlays=overlays(before, after))


def with_ties(found: tuple[Named, ...], tied: tuple[Tie, ...]) -> tuple[Named, ...]:
    """Return the names with the rivals that sensitivities show beside those that scores showed."""
    by_name: dict[str, list[str]] = {}
    for tie in tied:
        if tie.rival is not None and not tie.by_no_motion:
            by_name.setdefault(tie.effect, []).append(tie.rival)
    return tuple(
        replace(one, rivals=tuple(dict.fromkeys((*one.rivals, *by_name.get(one.effect, ())))))
        for one in found
    )


def with_velocity_lag(
    recording: Recording, case: Case, best: Fit, found: tuple[Named, ...]
) -> tuple[Fit, tuple[Named, ...]]:
    """Return fit and names with the filter of the reported velocities, where it shows and the twin does not have it."""
    lag = None if EFFECT in case.twin.effects else velocity_lag(recording, case.state)
    if lag is None:
        return best, found
    constant = lag.time_constant_s
    theta = best.theta.copy()
    theta[SLOTS[EFFECT]] = constant.value
    effects = {**best.twin.effects, EFFECT: {"time_constant_s": constant.value}}
    estimates = {**best.estimates, f"{EFFECT}.time_constant_s": constant}
    best = replace(
        best, theta=theta, twin=replace(best.twin, effects=effects), estimates=estimates
    )
    return best, (*found, Named(EFFECT, Lead(lag.ratio, lag.errors), ()))


def runs_by_part(case: Case, parts: Split) -> dict[str, WindowRuns]:
    """Return the free runs of the case's twin on the windows that were fitted on and on those that were held out."""
    return {"train": run_windows(case, parts.train), "held_out": run_windows(case, parts.held_out)}


def overlays(before: dict[str, WindowRuns], after: dict[str, WindowRuns]) -> tuple[Overlay, ...]:
    """Return the held-out runs of both twins beside what was measured, a channel each."""
    old, new = before["held_out"], after["held_out"]
    times = new.begin_s[:, None] + new.period_s * np.arange(new.measured.shape[1])
    return tuple(
        Overlay(
            JOINTS[joint],
            UNITS[joint],
            times,
            new.measured[..., k],
            old.runs[..., k],
            new.runs[..., k],
        )
        for k, joint in enumerate(new.channels)
    )
