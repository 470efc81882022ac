"""The verb `prove`: how often a diagnosis is right about concealed physics."""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from pendulum_sysid.fleet.engine import Engine
from pendulum_sysid.studies.proof.degrade.kinds import BY_NAME
from pendulum_sysid.studies.proof.degrade.study import Study, run_study
from pendulum_sysid.studies.proof.degrade.text import format_rows
from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof import prove
from pendulum_sysid.studies.proof.proof_text import format_proof
from pendulum_sysid.studies.proof.rival_models.registry import RIVAL_MODELS
from pendulum_sysid.studies.proof.rivals import RIVALS
from pendulum_sysid.verbs.said import ANSWERED, print_answer


def run(arguments: argparse.Namespace) -> int:
    """Do the proof that the options ask for, print its tables, and name its files."""
    folder = arguments.out or Path(f"proof_seed_{arguments.seed}")
    if arguments.degrade is not None:
        rows = run_study(make_study(arguments), folder, arguments.progress.report)
        file = folder / "degraded.json"
        print_answer(arguments, lambda: read_json(file), format_rows(rows), "", file)
        return ANSWERED
    proof = prove(make_plan(arguments), folder, arguments.progress.report)
    file = folder / "proof.json"
    tables = format_proof(proof.judgements, proof.responses)
    print_answer(arguments, lambda: read_json(file), tables, "", file, folder / "proof.html")
    return ANSWERED


def read_json(file: Path) -> Any:
    """Return the content of a JSON file that has just been written."""
    return json.loads(file.read_text(encoding="utf-8"))


def make_plan(arguments: argparse.Namespace) -> Plan:
    """Return the plan that the options stand for."""
    return Plan(
        trials=arguments.trials,
        seed=arguments.seed,
        pole_counts=arguments.pole_counts,
        seconds=arguments.seconds,
        closed_loop=arguments.closed_loop,
        relay=arguments.relay,
        pairs=arguments.pairs,
        rest=arguments.rest,
        kinds=arguments.kinds,
        twin=None if arguments.twin is None else str(arguments.twin),
        rivals=list_rivals() if arguments.rivals else (),
        dose_tries=arguments.dose_response,
        processes=arguments.workers,
        scheduler=arguments.scheduler,
    )


def list_rivals() -> tuple[str, ...]:
    """Return the names of all rivals: those that name effects, then those that predict."""
    return (
        *(rival.name for rival in RIVALS),
        *(rival.name for rival in RIVAL_MODELS),
    )


def make_study(arguments: argparse.Namespace) -> Study:
    """Return the study of degraded recordings that the options stand for."""
    return Study(
        trials=arguments.trials,
        seed=arguments.seed,
        kinds=tuple(arguments.degrade.split(",")) if arguments.degrade else tuple(BY_NAME),
        engine=Engine(arguments.workers, arguments.scheduler),
        twin=None if arguments.twin is None else str(arguments.twin),
    )
