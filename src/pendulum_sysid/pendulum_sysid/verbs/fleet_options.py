"""The options of `sysid fleet` and its own verbs, and of everything that runs on its engine."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from pendulum_sysid.verbs.shared_options import add_json, add_verb
from pendulum_twin.command_line import make_number_reader, make_whole_reader

if TYPE_CHECKING:
    from pendulum_sysid.verbs.shared_options import Verbs

STORE = "address of the store: a folder, or s3://bucket/folder and the like"


def add_engine(verb: argparse.ArgumentParser, workers: str = "--workers") -> None:
    """Add where the work is done: workers of a local cluster, or the address of another."""
    verb.add_argument(
        *dict.fromkeys((workers, "--workers")),
        dest="workers",
        type=make_whole_reader(1),
        default=2,
        metavar="N",
        help="worker processes of a local cluster",
    )
    address = "address of another Dask cluster in place of a local one, tcp://host:8786"
    verb.add_argument("--scheduler", metavar="ADDRESS", help=address)


def add_fleet(verbs: Verbs) -> None:
    """Add the verb `fleet` with its own verbs."""
    sentence = "examine many recordings of many rigs, and say what changed in which rig when"
    fleet = add_verb(verbs, "fleet", sentence)
    own = fleet.add_subparsers(dest="fleet_verb", metavar="VERB", required=True)
    _add_run(own)
    history = add_verb(
        own, "history", "every size of a rig over time: changes, drift, next week", "fleet"
    )
    _add_store(history)
    _add_rig(history)
    add_json(history)
    compare = add_verb(
        own, "compare", "the rigs side by side: which is unlike the others, in what", "fleet"
    )
    _add_store(compare)
    add_json(compare)
    page = add_verb(
        own, "page", "write a site: all rigs at a glance, a page a rig, every report", "fleet"
    )
    _add_store(page)
    page.add_argument(
        "--out", required=True, type=Path, metavar="DIR", help="the folder of the site"
    )
    add_json(page)
    twin = add_verb(
        own, "twin", "write a rig's twin of today, pooled since its last change", "fleet"
    )
    _add_store(twin)
    _add_rig(twin)
    twin.add_argument(
        "--out", required=True, type=Path, metavar="TWIN.yaml", help="the twin file to write"
    )
    add_json(twin)


def _add_run(own: Verbs) -> None:
    run = add_verb(own, "run", "examine the recordings that the store does not know yet", "fleet")
    folders = "a folder with recordings below it: a path, or s3://bucket/folder and the like"
    run.add_argument("folder", nargs="+", metavar="FOLDER", help=folders)
    table = "table of the rigs, their twins and their recordings (docs/fleet.md)"
    run.add_argument("--twins", required=True, type=Path, metavar="TABLE.yaml", help=table)
    run.add_argument("--store", required=True, metavar="STORE", help=STORE)
    method = "diagnose: name missing physics (default); fit: the sizes of the twin as it is"
    run.add_argument("--method", choices=("diagnose", "fit"), default="diagnose", help=method)
    add_engine(run)
    run.add_argument(
        "--memory",
        type=make_number_reader(0.2, 1000.0),
        default=2.0,
        metavar="GB",
        help="of a local worker; more ends it",
    )
    run.add_argument(
        "--time-limit",
        type=make_number_reader(1.0, 86_400.0),
        default=900.0,
        metavar="S",
        help="of a recording; more ends its worker",
    )
    add_json(run)


def _add_store(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("store", metavar="STORE", help=STORE)


def _add_rig(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("--rig", required=True, metavar="RIG", help="name of the rig")
