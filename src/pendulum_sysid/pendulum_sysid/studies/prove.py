"""The verb `prove`: how often a diagnosis is right about concealed physics."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_sysid.studies.proof.plan import Plan
from pendulum_sysid.studies.proof.proof import prove
from pendulum_sysid.studies.proof.proof_text import format_proof
from pendulum_sysid.studies.proof.rivals import RIVALS
from pendulum_sysid.verbs.said import ANSWERED, progress


def run(arguments: argparse.Namespace) -> int:
    """Do the proof that the options ask for, print its tables, and name its files."""
    folder = arguments.out or Path(f"proof_seed_{arguments.seed}")
    proof = prove(plan_of(arguments), folder, progress)
    print(format_proof(proof.judged, proof.responses))
    print("", folder / "proof.json", folder / "proof.html", sep="\n")
    return ANSWERED


def plan_of(arguments: argparse.Namespace) -> Plan:
    """Return the plan that the options stand for."""
    return Plan(
        trials=arguments.trials,
        seed=arguments.seed,
        pole_counts=arguments.pole_counts,
        seconds=arguments.seconds,
        closed_loop=arguments.closed_loop,
        kinds=arguments.kinds,
        twin=None if arguments.twin is None else str(arguments.twin),
        rivals=tuple(one.name for one in RIVALS) if arguments.rivals else (),
        dose_tries=arguments.dose_response,
        processes=arguments.processes,
    )
