"""The verb `check`: whether recordings can be of a twin's rig at all, before any search."""

from __future__ import annotations

import argparse

from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.plausibility.answers import Check, CheckAnswer
from pendulum_sysid.plausibility.ask import check_plausibility
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.telling.tables import format_table
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_twin.model import load_twin

HEADER = ("question", "answer", "expected", "found")


def run(arguments: argparse.Namespace) -> int:
    """Print the checks; status 1 when the answer to one of them is no."""
    twin = load_twin(arguments.twin)
    arguments.progress.report(Stage.READING)
    checks = check_plausibility(prepare_case(read_recordings(arguments.bag, arguments), twin))
    print_answer(arguments, lambda: make_mapping(checks), format_checks(checks))
    failed = [check for check in checks if check.answer is CheckAnswer.NO]
    return say(failed[0].sentence) if failed else ANSWERED


def make_mapping(checks: tuple[Check, ...]) -> dict[str, list[dict[str, str]]]:
    """Return what `--json` prints."""
    rows = [
        {
            "question": check.question,
            "answer": check.answer.value,
            "expected": check.expected,
            "found": check.observed,
            "advice": check.advice,
        }
        for check in checks
    ]
    return {"checks": rows}


def format_checks(checks: tuple[Check, ...]) -> str:
    """Return a row a check, and below them what to do."""
    rows = [
        (check.question, check.answer.value, check.expected, check.observed) for check in checks
    ]
    advice = [f"{check.question} {check.advice}" for check in checks if check.advice]
    return "\n".join([format_table(HEADER, rows), *advice])
