"""The verb `diagnose`: from recordings and a twin to a verdict, a report and an improved twin."""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

from pendulum_sysid import pipeline
from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.fitting.parameters import hold_constants
from pendulum_sysid.records import Outcome
from pendulum_sysid.telling.folder_swap import replace_files
from pendulum_sysid.telling.output_files import (
    check_folder,
    format_json,
    name_write_errors,
    write_text,
)
from pendulum_sysid.telling.report import write_report
from pendulum_sysid.telling.verdict import NEXT_FILE
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.said import ANSWERED, Colour, paint, print_answer, say
from pendulum_sysid.verdict.drawn import Origin
from pendulum_sysid.verdict.record import Verdict
from pendulum_twin.files import compute_digest
from pendulum_twin.model import load_twin, save_twin
from pendulum_twin.plans.plan_file import parse_plan, save_plan
from pendulum_twin.user_effects import list_effect_folders
from pendulum_twin.version import __version__

COLOURS = {
    Outcome.NAMED: Colour.GOOD,
    Outcome.NOTHING_MISSING: Colour.GOOD,
    Outcome.AMBIGUOUS: Colour.DOUBTFUL,
    Outcome.NOT_IN_CATALOGUE: Colour.DOUBTFUL,
    Outcome.UNUSABLE: Colour.BAD,
}


def run(arguments: argparse.Namespace) -> int:
    """Diagnose, write what was found, and print the verdict's sentence and the files."""
    check_folder(arguments.out)
    twin = hold_constants(load_twin(arguments.twin), arguments.hold)
    arguments.progress.follow_stages()
    report = arguments.progress.report
    report(Stage.READING)
    verdict = pipeline.diagnose(read_recordings(arguments.bag, arguments), twin, report)
    verdict = replace(verdict, command=arguments.shell_line, origin=describe_origin(arguments))
    report(Stage.WRITING)
    written = write_diagnosis(verdict, arguments.out, arguments.twin)
    unusable = verdict.outcome is Outcome.UNUSABLE
    sentence = paint(verdict.sentence, COLOURS[verdict.outcome], sys.stdout)
    print_answer(arguments, verdict.to_dict, *([] if unusable else [sentence]), *written)
    for warning in verdict.warnings:
        say(f"before you use the twin: {warning}", ANSWERED)
    return say(verdict.sentence) if unusable else ANSWERED


def describe_origin(arguments: argparse.Namespace) -> Origin:
    """Return when and of which files a verdict is made, for its report."""
    options = {"--state-topic": arguments.state_topic, "--command-topic": arguments.command_topic}
    return Origin(
        date=datetime.now(UTC).isoformat(sep=" ", timespec="seconds"),
        version=__version__,
        recordings=tuple(str(path) for path in arguments.bag),
        twin=str(arguments.twin),
        twin_digest=compute_digest([arguments.twin]),
        folder=str(arguments.out),
        topics=tuple(word for name, topic in options.items() if topic for word in (name, topic)),
        constants=tuple(arguments.hold),
        effects=tuple(_shorten(folder) for folder in list_effect_folders()),
    )


def _shorten(folder: str) -> str:
    """Return a path as a command in this folder needs it: relative where it lies below."""
    path = Path(folder)
    return str(path.relative_to(Path.cwd()) if path.is_relative_to(Path.cwd()) else path)


def write_diagnosis(verdict: Verdict, folder: Path, started_from: Path) -> list[Path]:
    """Write verdict, report, improved twin and plan into a folder, and return the files.

    They come all at once, see `folder_swap`. An improved twin or a plan of an earlier diagnosis is
    removed; the twin that the diagnosis started from is not.
    """
    names = ("verdict.json", "report.html", "twin.yaml", NEXT_FILE)
    with name_write_errors(folder), replace_files(folder, names, keep=started_from) as new:
        write_text(new / names[0], format_json(verdict.to_dict()) + "\n")
        write_report(verdict, new / names[1])
        if verdict.twin is not None:
            save_twin(verdict.twin, new / names[2])
        if verdict.next_plan is not None:
            save_plan(parse_plan(verdict.next_plan), new / NEXT_FILE)
        written = [name for name in names if (new / name).exists()]
    return [folder / name for name in written]
