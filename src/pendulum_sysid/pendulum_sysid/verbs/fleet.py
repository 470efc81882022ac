"""The verb `fleet`: many recordings, and what their history says."""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from pendulum_sysid.fleet.comparison import compare_rigs, describe_comparison
from pendulum_sysid.fleet.engine import Engine
from pendulum_sysid.fleet.history import PRESENCE, History, describe_history, read_histories
from pendulum_sysid.fleet.json_form import encode_comparison, encode_history
from pendulum_sysid.fleet.page import write_site
from pendulum_sysid.fleet.run import run_fleet
from pendulum_sysid.fleet.store import Store
from pendulum_sysid.fleet.today import make_twin_of_today
from pendulum_sysid.telling.output_files import check_file, name_write_errors
from pendulum_sysid.telling.tables import format_number, format_table
from pendulum_sysid.verbs.said import ANSWERED, print_answer, say
from pendulum_twin.model import save_twin


def run(arguments: argparse.Namespace) -> int:
    """Run one of the verb's own verbs and return the exit status."""
    verbs = {
        "run": examine,
        "history": tell_history,
        "compare": compare,
        "page": write_pages,
        "twin": write_twin,
    }
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
        arguments.progress.report,
    )
    print_answer(
        arguments,
        lambda: {**asdict(tally), "store": arguments.store},
        f"{tally.recordings} recordings: {tally.known} known, {tally.done} examined, "
        f"{tally.unanswered} of them without an answer, {tally.strays} of no rig",
        arguments.store,
    )
    if tally.done and tally.unanswered == tally.done:
        return say("none of the new recordings gave an answer; the lines above say why")
    return ANSWERED


def tell_history(arguments: argparse.Namespace) -> int:
    """Print what changed in a rig and when, and every size of today."""
    (history,) = read_histories(Store(arguments.store), arguments.rig)
    print_answer(
        arguments,
        lambda: encode_history(history),
        *describe_history(history),
        "\n" + format_table(SIZES, _make_rows(history)),
    )
    for name, count in history.left_out.items():
        say(f"{name}: {count} recordings fix it, too few to ask whether it changed", ANSWERED)
    return ANSWERED


SIZES = ("size", "today", "low", "high", "next week", "low", "high", "unit", "recordings")


def _make_rows(history: History) -> list[tuple[str, ...]]:
    return [
        (
            size.name,
            *(format_number(x) for x in (size.today.value, size.today.low, size.today.high)),
            *(format_number(x) for x in size.next_week),
            size.unit,
            f"{size.today.count} of {len(size.rows)}",
        )
        for size in history.sizes
        if size.parameter != PRESENCE
    ]


def compare(arguments: argparse.Namespace) -> int:
    """Print which rigs are unlike the others, and the sizes that they have in common."""
    comparison = compare_rigs(read_histories(Store(arguments.store)))
    rows = [
        (
            name,
            *(format_number(x) for x in (f.mean, f.low, f.high, f.between, f.within)),
            comparison.units[name],
            str(len(f.rigs)),
        )
        for name, f in comparison.families.items()
    ]
    head = ("size", "mean", "low", "high", "rig to rig", "recording to recording", "unit", "rigs")
    print_answer(
        arguments,
        lambda: encode_comparison(comparison),
        *describe_comparison(comparison),
        *(["\n" + format_table(head, rows)] if rows else []),
    )
    return ANSWERED


def write_pages(arguments: argparse.Namespace) -> int:
    """Write the site and print its first page."""
    pages = write_site(Store(arguments.store), arguments.out)
    print_answer(arguments, lambda: {"pages": [str(page) for page in pages]}, pages[0])
    return ANSWERED


def write_twin(arguments: argparse.Namespace) -> int:
    """Write a rig's twin of today and print what it took from the recordings."""
    check_file(arguments.out)
    store = Store(arguments.store)
    (history,) = read_histories(store, arguments.rig)
    twin, used = make_twin_of_today(store, history)
    with name_write_errors(arguments.out):
        save_twin(twin, arguments.out)
    rows = [
        (name, *(format_number(x) for x in (p.value, p.low, p.high)), str(p.count))
        for name, p in used.items()
    ]
    print_answer(
        arguments,
        lambda: {
            "sizes": {name: asdict(size) for name, size in used.items()},
            "file": str(arguments.out),
        },
        format_table(("size", "value", "low", "high", "recordings"), rows),
        f"\n{arguments.out}",
    )
    return ANSWERED
