"""The proof from beginning to end: record, examine, open the seals, judge, and write what came of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from pendulum_sysid.studies.proof import plan as plans
from pendulum_sysid.studies.proof import record_trial as trials
from pendulum_sysid.studies.proof.dose_response import Response, list_dosed_sets, measure_responses
from pendulum_sysid.studies.proof.examine_trial import read_examined
from pendulum_sysid.studies.proof.judge_trial import judge_trial
from pendulum_sysid.studies.proof.page import render_page
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof_json import make_proof_mapping
from pendulum_sysid.studies.proof.read_trial import read_trial
from pendulum_sysid.studies.proof.records import Judgement
from pendulum_sysid.studies.proof.rivals import find_rival
from pendulum_sysid.studies.proof.workers import examine_trials
from pendulum_sysid.telling.output_files import check_folder, json_text, write_text
from pendulum_twin.errors import BadInputError
from pendulum_twin.model import load_twin

Say = Callable[[str], None]


@dataclass(frozen=True)
class Proof:
    """Hold what was planned and what came of it. elapsed_s: of this run, which may have gone on from an earlier one."""

    plan: Plan
    judged: tuple[Judgement, ...]
    responses: tuple[Response, ...]
    elapsed_s: float


def prove(plan: Plan, folder: Path, say: Say) -> Proof:
    """Do what the plan says, going on from what is in the folder already, and write proof.json and proof.html there.

    Trials stand in folder/trials and folder/dose, each with what was found about it, so a proof
    that is broken off loses none. Raises BadInputError when trials cannot be made or the folder
    holds another proof.
    """
    began = time.monotonic()
    trials.check()
    for name in plan.rivals:
        find_rival(name).check()
    check_folder(folder)
    plans.claim_folder(plan, folder)
    kinds = ["--kinds", plan.kinds] if plan.kinds else []
    judged = _judged(plan, folder / "trials", plan.trials, kinds, plan.rivals, say)
    found = _responses(plan, folder / "dose", say) if plan.dose_tries else []
    proof = Proof(plan, tuple(judged), tuple(found), time.monotonic() - began)
    write_text(
        folder / "proof.json",
        json_text(make_proof_mapping(proof.plan, proof.judged, proof.responses, proof.elapsed_s))
        + "\n",
    )
    write_text(
        folder / "proof.html",
        render_page(proof.plan, proof.judged, proof.responses, proof.elapsed_s),
    )
    return proof


def _responses(plan: Plan, folder: Path, say: Say) -> list[Response]:
    def ask(sets: Sequence[str], factor: float) -> list[Judgement]:
        say(f"dose-response: sizes times {factor:g}, {len(sets)} effects")
        options = ["--size-factor", f"{factor:g}", "--effects", *sets]
        return _judged(
            plan, folder / f"times_{factor:g}", plan.dose_tries * len(sets), options, (), say
        )

    return measure_responses(ask, list_dosed_sets())


def _judged(
    plan: Plan, folder: Path, count: int, options: Sequence[str], rivals: Sequence[str], say: Say
) -> list[Judgement]:
    """Return so many trials, made and examined where they are not yet, and judged."""
    done = 0

    def tell(one: Path) -> None:
        nonlocal done
        done += 1
        judged = judge_folder(one)
        say(
            f"{done}/{count} {one.name} ({judged.sealed.kind}): {judged.names.how.value}, {judged.seconds:.1f} s"
        )

    made = trials.trial_folders(folder, count, [*plan.maker_arguments(), *options])
    return [judge_folder(one) for one in examine_trials(made, rivals, plan.processes, tell)]


def judge_folder(folder: Path) -> Judgement:
    """Return the trial in a folder judged; raise BadInputError when it has not been examined."""
    found = read_examined(folder)
    if found is None:
        raise BadInputError(
            f"{folder}: expected a trial that has been examined, found none: run the proof again"
        )
    sealed = read_trial(folder)
    return judge_trial(sealed, found, load_twin(sealed.twin).rig)
