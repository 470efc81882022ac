"""The proof from beginning to end: record, examine, open the seals, compare, write."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid.studies.proof.dose_response import (
    Response,
    list_dosed_sets,
    measure_responses,
)
from pendulum_sysid.studies.proof.examine_trial import read_examined
from pendulum_sysid.studies.proof.judge_trial import judge_trial
from pendulum_sysid.studies.proof.page import render_page
from pendulum_sysid.studies.proof.plan import Plan, claim_folder
from pendulum_sysid.studies.proof.proof_json import make_proof_mapping
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.record_trial import check_options, check_recorder
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.rival_models.registry import find_rival_model, is_rival_model
from pendulum_sysid.studies.proof.rivals import find_rival
from pendulum_sysid.studies.proof.workers import examine_trials
from pendulum_sysid.telling.output_files import check_folder, format_json, write_text
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Proof:
    """Hold what was planned and the results.

    plan: the options.
    judgements: the trials, compared with their seals.
    responses: the dose-response of each effect; empty when none was planned.
    elapsed_s: wall time of this run, which may have gone on from an earlier run, s.
    """

    plan: Plan
    judgements: tuple[Judgement, ...]
    responses: tuple[Response, ...]
    elapsed_s: float


def prove(plan: Plan, folder: Path, progress: Progress) -> Proof:
    """Do what the plan says, and write proof.json and proof.html into the folder.

    Trials stand in folder/trials and folder/dose, each with its results, so that a proof that is
    broken off loses none and goes on from there.

    Raises BadInputError when trials cannot be recorded or the folder holds another proof, WrongUse
    when the recorder refuses an option, before anything is written, and WorkerError when a process
    dies.
    """
    began = time.monotonic()
    check_recorder()
    for name in plan.rivals:
        rival = find_rival_model(name) if is_rival_model(name) else find_rival(name)
        rival.check_installed()
    check_folder(folder)
    kinds = ["--kinds", plan.kinds] if plan.kinds else []
    check_options([*plan.list_recorder_options(), *kinds])
    claim_folder(plan, folder)
    judgements = _run_trials(plan, folder / "trials", plan.trials, kinds, plan.rivals, progress)
    responses = _run_doses(plan, folder / "dose", progress) if plan.dose_tries else []
    proof = Proof(plan, tuple(judgements), tuple(responses), time.monotonic() - began)
    results = (proof.plan, proof.judgements, proof.responses, proof.elapsed_s)
    write_text(folder / "proof.json", format_json(make_proof_mapping(*results)) + "\n")
    write_text(folder / "proof.html", render_page(*results))
    return proof


def judge_folder(folder: Path) -> Judgement:
    """Return the trial in a folder compared with its seal.

    Raises BadInputError when it has not been examined.
    """
    examined = read_examined(folder)
    if examined is None:
        raise BadInputError(
            f"{folder}: expected a trial that has been examined, found none: run the proof again"
        )
    trial = read_trial(folder)
    return judge_trial(trial, examined, load_twin(trial.twin).rig)


def _run_doses(plan: Plan, folder: Path, progress: Progress) -> list[Response]:
    def run_sets(sets: Sequence[str], factor: float) -> list[Judgement]:
        progress(f"dose-response: sizes times {factor:g}, {len(sets)} effects")
        options = ["--size-factor", f"{factor:g}", "--effects", *sets]
        count = plan.dose_tries * len(sets)
        return _run_trials(plan, folder / f"times_{factor:g}", count, options, (), progress)

    return measure_responses(run_sets, list_dosed_sets())


def _run_trials(
    plan: Plan,
    folder: Path,
    count: int,
    options: Sequence[str],
    rivals: Sequence[str],
    progress: Progress,
) -> list[Judgement]:
    """Return the first trials of a folder, recorded and examined where they are not yet."""
    done = 0

    def report_trial(trial: Path) -> None:
        nonlocal done
        done += 1
        judgement = judge_folder(trial)
        progress(
            f"{done}/{count} {trial.name} ({judgement.trial.kind}): "
            f"{judgement.names.outcome.value}, {judgement.seconds:.1f} s"
        )

    options = [*plan.list_recorder_options(), *options]
    trials = examine_trials(folder, count, options, rivals, plan.engine, report_trial)
    return [judge_folder(trial) for trial in trials]
