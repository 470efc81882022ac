"""The verb `fleet`: many recordings, and what their history says."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_sysid.fleet.engine import Engine
from pendulum_sysid.fleet.run import run_fleet
from pendulum_sysid.verbs.said import ANSWERED, print_progress, say


def run(arguments: argparse.Namespace) -> int:
    """Run one of the verb's own verbs and return the exit status."""
    verbs = {"run": examine}
    return verbs[arguments.fleet_verb](arguments)


def examine(arguments: argparse.Namespace) -> int:
    """Examine what the store does not know yet; say how many there are and how many failed."""
    engine = Engine(
        workers=arguments.workers,
        scheduler=arguments.scheduler,
        memory_bytes=int(1e9 * arguments.memory),
        time_limit_s=arguments.time_limit,
    )
    tally = run_fleet(
        arguments.folder,
        Path(arguments.twins),
        arguments.store,
        engine,
        arguments.method,
        print_progress,
    )
    print(
        f"{tally.found} recordings: {tally.known} known, {tally.done} examined, "
        f"{tally.unanswered} of them without an answer, {tally.strays} of no rig"
    )
    print(arguments.store)
    if tally.done and tally.unanswered == tally.done:
        return say("none of the new recordings gave an answer; the lines above say why")
    return ANSWERED
