"""The verb `diagnose`: from recordings and a twin to a verdict, a report and an improved twin."""

from __future__ import annotations

import argparse
from pathlib import Path

from pendulum_sysid import pipeline
from pendulum_sysid.records import Diagnosis, Outcome
from pendulum_sysid.telling.output_files import check_folder, json_text, write_text, writing
from pendulum_sysid.telling.report import write_report
from pendulum_sysid.telling.verdict import NEXT_FILE
from pendulum_sysid.verbs.recordings import recordings
from pendulum_sysid.verbs.said import ANSWERED, progress, say
from pendulum_twin.model import load_twin, save_twin
from pendulum_twin.plans.plan_file import parse_plan, save_plan


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, write what was found, and print the verdict's sentence and the files."""
    check_folder(arguments.out)
    twin = load_twin(arguments.twin)
    diagnosis = pipeline.diagnose(recordings(arguments.bag, arguments), twin, progress)
    written = write_diagnosis(diagnosis, arguments.out, arguments.twin)
    sentence = diagnosis.verdict["sentence"]
    unusable = diagnosis.verdict["outcome"] == Outcome.UNUSABLE.value
    print(*([] if unusable else [sentence]), *written, sep="\n")
    return say(sentence) if unusable else ANSWERED


def write_diagnosis(diagnosis: Diagnosis, folder: Path, started_from: Path) -> list[Path]:
    """Write what was found and return the files; an improved twin of an earlier diagnosis must not stand beside it."""
    verdict, report, improved = (
        folder / "verdict.json",
        folder / "report.html",
        folder / "twin.yaml",
    )
    coming = folder / NEXT_FILE
    with writing(folder):
        if diagnosis.twin is None and improved.exists() and not improved.samefile(started_from):
            improved.unlink()
        coming.unlink(missing_ok=True)
        if diagnosis.next_plan is not None:
            save_plan(parse_plan(diagnosis.next_plan), coming)
        write_text(verdict, json_text(diagnosis.verdict) + "\n")
        if diagnosis.twin is not None:
            save_twin(diagnosis.twin, improved)
        write_report(diagnosis, report)
    there = (
        verdict,
        report,
        improved if diagnosis.twin else None,
        coming if diagnosis.next_plan else None,
    )
    return [path for path in there if path is not None]
