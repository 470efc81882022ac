"""The verb `diagnose`: from recordings and a twin to a verdict, a report and an improved twin."""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from pendulum_sysid import pipeline
from pendulum_sysid.fitting.parameters import hold_constants
from pendulum_sysid.records import Outcome
from pendulum_sysid.telling.output_files import (
    check_folder,
    format_json,
    name_write_errors,
    write_text,
)
from pendulum_sysid.telling.report import write_report
from pendulum_sysid.telling.verdict import NEXT_FILE
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, print_progress, say
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.model import load_twin, save_twin
from pendulum_twin.plans.plan_file import parse_plan, save_plan


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, write what was found, and print the verdict's sentence and the files."""
    check_folder(arguments.out)
    twin = hold_constants(load_twin(arguments.twin), arguments.hold)
    verdict = pipeline.diagnose(read_recordings(arguments.bag, arguments), twin, print_progress)
    verdict = replace(verdict, command=arguments.shell_line)
    written = write_diagnosis(verdict, arguments.out, arguments.twin)
    if verdict.outcome is Outcome.UNUSABLE:
        print(*written, sep="\n")
        return say(verdict.sentence)
    print(verdict.sentence, *written, sep="\n")
    return ANSWERED


def write_diagnosis(verdict: Verdict, folder: Path, started_from: Path) -> list[Path]:
    """Write verdict, report, improved twin and plan into a folder, and return the files.

    An improved twin or a plan of an earlier diagnosis is removed; the twin that the diagnosis
    started from is not.
    """
    files = {name: folder / name for name in ("verdict.json", "report.html", "twin.yaml")}
    improved, plan = files["twin.yaml"], folder / NEXT_FILE
    with name_write_errors(folder):
        if verdict.twin is None and improved.exists() and not improved.samefile(started_from):
            improved.unlink()
        plan.unlink(missing_ok=True)
        if verdict.next_plan is not None:
            save_plan(parse_plan(verdict.next_plan), plan)
        write_text(files["verdict.json"], format_json(verdict.to_dict()) + "\n")
        if verdict.twin is not None:
            save_twin(verdict.twin, improved)
        write_report(verdict, files["report.html"])
    if verdict.twin is None:
        del files["twin.yaml"]
    return [*files.values(), *([plan] if verdict.next_plan is not None else [])]
