"""The verb `compare`: two twins side by side on recordings."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from pendulum_sysid.finding.stages import Stage
from pendulum_sysid.fitting.compare import Pair, compare_two
from pendulum_sysid.prepare import prepare_case
from pendulum_sysid.telling.output_files import check_file
from pendulum_sysid.telling.tables import format_table, make_comparison_rows
from pendulum_sysid.verbs.recordings import read_recordings
from pendulum_sysid.verbs.replay import make_mapping, say_doubts, say_if_diverged
from pendulum_sysid.verbs.said import ANSWERED, print_answer
from pendulum_twin.model import load_twin


def run(arguments: argparse.Namespace) -> int:
    """Print both twins' errors on all recordings together; draw their runs if asked to."""
    if len(arguments.twin) != 2:
        arguments.parser.error(
            f"expected --twin A --twin B, found --twin {len(arguments.twin)} time(s)"
        )
    names = (str(arguments.twin[0]), str(arguments.twin[1]))
    if arguments.out is not None:
        _check_plot(arguments.out)
    arguments.progress.report(Stage.READING)
    twins = [load_twin(path) for path in arguments.twin]
    case = prepare_case(read_recordings(arguments.bag, arguments), twins[0])
    say_doubts(case)
    pair = compare_two(case, twins[1])
    for path, comparison in zip(arguments.twin, pair.comparisons, strict=True):
        say_if_diverged(path, comparison)
    if arguments.out is not None:
        _draw(arguments.out, case.recording.name, names, pair)
    first = pair.comparisons[0]
    print_answer(
        arguments,
        lambda: make_mapping_of_pair(names, pair, arguments.out),
        f"{first.count} windows of {first.seconds:g} s",
        format_table(("measure", *names, "unit"), make_comparison_rows(pair.comparisons)),
        f"\n{names[1]} is the better one in {pair.second_better} windows of {first.count}",
        *([] if arguments.out is None else [arguments.out]),
    )
    return ANSWERED


def make_mapping_of_pair(names: tuple[str, str], pair: Pair, plot: Path | None) -> dict[str, Any]:
    """Return what `--json` prints: what `replay` prints, for either twin, and which is better."""
    return {
        "twins": [
            {"twin": name, **make_mapping(comparison)}
            for name, comparison in zip(names, pair.comparisons, strict=True)
        ],
        "second_better_in": pair.second_better,
        "windows": pair.comparisons[0].count,
        "plot": None if plot is None else str(plot),
    }


# A picture needs matplotlib, which takes longer to import than all else.


def _check_plot(path: Path) -> None:
    from pendulum_sysid.telling.compare_plot import check_format

    check_format(path)
    check_file(path)


def _draw(path: Path, title: str, names: tuple[str, str], pair: Pair) -> None:
    from pendulum_sysid.telling.compare_plot import draw_comparison

    draw_comparison(path, title, names, pair.runs)
